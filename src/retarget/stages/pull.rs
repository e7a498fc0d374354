//! Moves the pelvis until held feet are within reach. (retargeting.md B43c.)

use glam::DVec3;

use crate::{
    model::{Canceled, Transform},
    rig::Ground,
};

use super::{
    posing::{Pose, Posing},
    temporal::smoothed,
    work::{Change, Changed, Work},
};

/// Rounds of projecting onto what each leg reaches.
const ROUNDS: usize = 8;
/// Standard deviation of the smoothing over time.
const SMOOTHING_SECONDS: f64 = 0.12;
/// Rounds of smoothing.
const SMOOTH_ROUNDS: usize = 4;
/// Feet that are held by less than this do not pull.
const LEAST_HOLD: f64 = 0.5;

/// Moves the pelvis.
#[derive(Clone, Debug)]
pub(super) struct PullStage {
    pub(super) pelvis: usize,
    pub(super) legs: Vec<PulledLeg>,
    pub(super) posing: Posing,
    pub(super) ground: Ground,
    pub(super) sideways_cost: f64,
    pub(super) limb_count: usize,
    /// Whether held feet pull; else the pelvis is only shifted by what other stages ask for.
    pub(super) pulls: bool,
}

/// A leg that may pull.
#[derive(Clone, Copy, Debug)]
pub(super) struct PulledLeg {
    pub(super) limb: usize,
    /// Slot of the hip.
    pub(super) start: usize,
    /// Length of both bones.
    pub(super) length: f64,
    /// Share of it up to which the leg goes without being softened.
    pub(super) firm: f64,
}

impl PullStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut moves = std::mem::take(&mut work.pelvis_moves);
        moves.resize(work.frame_count(), DVec3::ZERO);
        if self.pulls {
            self.pull(&mut moves, work)?;
        }
        if moves.iter().all(|moved| *moved == DVec3::ZERO) {
            return Ok(());
        }
        let slot = self.posing.slot(self.pelvis);
        let changed = [Changed { joint: self.pelvis, rotates: false, moves: true }];
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.posing.fill(pose, &work.target, frame);
            let parent = self.posing.parent_of(pose, slot);
            let now = pose.model[slot];
            let moved = Transform { translation: now.translation + moves[frame], ..now };
            row[0].translation = parent.relative(&moved).translation.as_vec3();
        };
        let rows = work.rows(1, || self.posing.pose(), fill)?;
        work.write(&changed, &rows);
        Ok(())
    }

    /// Adds what makes held feet reachable, smooth over time.
    fn pull(&self, moves: &mut [DVec3], work: &Work<'_>) -> Result<(), Canceled> {
        let needed = |moves: &[DVec3]| {
            work.rows(
                1,
                || self.posing.pose(),
                |pose, frame, row: &mut [DVec3]| {
                    self.posing.fill(pose, &work.target, frame);
                    row[0] = self.least_move(work, pose, frame, moves[frame]);
                },
            )
        };
        let add = |moves: &mut [DVec3], more: &[DVec3]| {
            moves.iter_mut().zip(more).for_each(|(moved, more)| *moved += *more);
        };
        // Smoothing takes the tips off, so what is still missing is added again, as smoothly. The little that is left after all
        // rounds is left to the legs: a jolt of the whole body is worse.
        for _ in 0..SMOOTH_ROUNDS {
            let missing = needed(moves)?;
            if missing.iter().all(|missing| *missing == DVec3::ZERO) {
                break;
            }
            add(moves, &smoothed(&missing, work.times, SMOOTHING_SECONDS));
        }
        Ok(())
    }

    /// The least move, counting sideways ones dearer, after which every held foot is within reach of its hip.
    fn least_move(&self, work: &Work<'_>, pose: &Pose, frame: usize, already: DVec3) -> DVec3 {
        let up = self.ground.up;
        let mut moved = DVec3::ZERO;
        for _ in 0..ROUNDS {
            let mut is_reached = true;
            for leg in &self.legs {
                let goal = &work.goals[frame * self.limb_count + leg.limb];
                if goal.hold < LEAST_HOLD {
                    continue;
                }
                let reach = leg.length * goal.extension.max(leg.firm);
                let from_goal = pose.model[leg.start].translation + already + moved - goal.position;
                let missing = from_goal.length() - reach;
                if missing > 1e-9 * leg.length {
                    is_reached = false;
                    let toward = -from_goal.normalize();
                    let upward = up * toward.dot(up);
                    // The step along the cheap direction that shortens the distance by what is missing, to first order.
                    let step = upward + (toward - upward) / self.sideways_cost;
                    moved += step * (missing / step.dot(toward).max(1e-6));
                }
            }
            if is_reached {
                break;
            }
        }
        moved
    }
}
