//! Moves the pelvis until held feet are within reach. (docs/algorithm/legs.md.)

use super::stage::Stage;
use crate::retarget::mapping::Ground;
use glam::{DMat3, DVec3};

use crate::model::{Canceled, Transform};

use super::{
    posing::{Pose, Posing},
    temporal::smoothed,
    work::{Change, Changed, Work},
};

/// Rounds of projecting onto what each leg reaches.
const ROUNDS: usize = 8;
/// Standard deviation of the smoothing over time.
const SMOOTHING_SECONDS: f64 = 0.12;
/// Standard deviation of the smoothing of what keeps legs in shape.
const BALANCE_SECONDS: f64 = 0.06;
/// How dear it is to move the pelvis at all, beside turning the bones of a leg that is bent by a right angle.
const STIFFNESS: f64 = 0.1;
/// Keeps straight legs from weighing more than anything.
const MIN_BENT: f64 = 0.03;
/// Rounds of smoothing.
const SMOOTH_ROUNDS: usize = 4;
/// Share of a leg by which a foot may miss its place before the pelvis gives way: legs that are nearly straight bend by degrees for a
/// pelvis that is lower by millimeters.
const LEFT_TO_THE_LEG: f64 = 0.01;
/// Feet that are held by less than this do not pull.
const MIN_HOLD: f64 = 0.5;

/// Moves the pelvis.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct PullStage {
    pub(in crate::retarget) pelvis: usize,
    pub(in crate::retarget) legs: Vec<PulledLeg>,
    pub(in crate::retarget) posing: Posing,
    pub(in crate::retarget) ground: Ground,
    pub(in crate::retarget) sideways_cost: f64,
    pub(in crate::retarget) limb_count: usize,
    /// Whether held feet pull; else the pelvis is only shifted by what other stages ask for.
    pub(in crate::retarget) pulls: bool,
}

/// A leg that may pull.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PulledLeg {
    pub(in crate::retarget) limb: usize,
    /// Slot of the hip.
    pub(in crate::retarget) start: usize,
    /// Share of its length up to which the leg goes without being softened.
    pub(in crate::retarget) firm: f64,
}

impl PullStage {
    /// Where the legs begin before the pelvis is moved, frame by frame.
    fn hips(&self, work: &Work<'_>) -> Result<Vec<DVec3>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            self.posing.fill_model(pose, &work.target, frame);
            for (leg, hip) in self.legs.iter().zip(row) {
                *hip = pose.model[leg.start].translation;
            }
        };
        work.rows(self.legs.len(), || self.posing.pose(), fill)
    }

    /// Adds what lets held legs keep their shape.
    fn balance(&self, moves: &mut [DVec3], hips: &[DVec3], work: &Work<'_>) -> Result<(), Canceled> {
        let fill = |(): &mut (), frame: usize, row: &mut [DVec3]| {
            row[0] = self.balanced(work, hips, frame, moves[frame]);
        };
        let wanted = work.rows(1, || (), fill)?;
        let wanted = smoothed(&wanted, work.performed, BALANCE_SECONDS);
        moves.iter_mut().zip(wanted).for_each(|(moved, wanted)| *moved += wanted);
        Ok(())
    }

    /// The move after which held legs are as long as they were before their feet were moved, as far as that goes for all of them.
    ///
    /// Minimizes `Σ w (u · x − m)² + x · C · x`, with `u` from the goal to the hip, `m` what the leg is too short by, `w` how much its
    /// bones turn when its length changes: a leg that is nearly straight bends by 8 degrees for a hundredth of its length.
    fn balanced(&self, work: &Work<'_>, hips: &[DVec3], frame: usize, already: DVec3) -> DVec3 {
        let up = self.ground.up;
        let sideways = DMat3::IDENTITY - outer(up, up);
        let mut matrix = (outer(up, up) + sideways * self.sideways_cost.powi(2)) * STIFFNESS;
        let mut vector = DVec3::ZERO;
        for (leg, hip) in self.legs.iter().zip(&hips[frame * self.legs.len()..]) {
            let goal = &work.goals[frame * self.limb_count + leg.limb];
            let from_goal = *hip + already - goal.position;
            let Some(away) = from_goal.try_normalize() else { continue };
            let bent = 1.0 - (goal.span / goal.length).clamp(0.0, 1.0).powi(2);
            let weight = goal.hold / (bent + MIN_BENT);
            matrix += outer(away, away) * weight;
            vector += away * (weight * (goal.span - from_goal.length()));
        }
        matrix.inverse() * vector
    }

    /// Adds what makes held feet reachable, smooth over time.
    fn pull(&self, moves: &mut [DVec3], hips: &[DVec3], work: &Work<'_>) -> Result<(), Canceled> {
        let needed = |moves: &[DVec3]| {
            let fill = |(): &mut (), frame: usize, row: &mut [DVec3]| {
                row[0] = self.least_move(work, hips, frame, moves[frame]);
            };
            work.rows(1, || (), fill)
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
            add(moves, &smoothed(&missing, work.performed, SMOOTHING_SECONDS));
        }
        Ok(())
    }

    /// Feet that are not held go where the pelvis goes, so that their legs keep their shape, as long as they stay out of the floor.
    fn take_along(&self, moves: &[DVec3], shifts: &[DVec3], work: &mut Work<'_>) -> Result<(), Canceled> {
        let up = self.ground.up;
        work.change_goals(self.limb_count, |_, frame, goals| {
            for leg in &self.legs {
                let goal = &mut goals[leg.limb];
                let along = (moves[frame] - shifts[frame]) * (1.0 - goal.hold);
                let height = along.dot(up);
                goal.position += along + up * (height.max(-goal.headroom) - height);
            }
        })
    }

    /// The least move, counting sideways ones dearer, after which every held foot is within reach of its hip.
    fn least_move(&self, work: &Work<'_>, hips: &[DVec3], frame: usize, already: DVec3) -> DVec3 {
        let up = self.ground.up;
        let mut moved = DVec3::ZERO;
        for _ in 0..ROUNDS {
            let mut is_reached = true;
            for (leg, hip) in self.legs.iter().zip(&hips[frame * self.legs.len()..]) {
                let goal = &work.goals[frame * self.limb_count + leg.limb];
                if goal.hold < MIN_HOLD {
                    continue;
                }
                let reach = goal.length * (goal.extension.max(leg.firm) + LEFT_TO_THE_LEG);
                let from_goal = *hip + already + moved - goal.position;
                let missing = from_goal.length() - reach;
                if missing > 1e-9 * goal.length {
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

impl Stage for PullStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut moves = std::mem::take(&mut work.pelvis_moves);
        moves.resize(work.frame_count(), DVec3::ZERO);
        if self.pulls {
            let shifts = moves.clone();
            let hips = self.hips(work)?;
            self.balance(&mut moves, &hips, work)?;
            self.pull(&mut moves, &hips, work)?;
            self.take_along(&moves, &shifts, work)?;
        }
        if moves.iter().all(|moved| *moved == DVec3::ZERO) {
            return Ok(());
        }
        let slot = self.posing.slot(self.pelvis);
        let changed = [Changed { joint: self.pelvis, rotates: false, moves: true }];
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.posing.fill_model(pose, &work.target, frame);
            let parent = self.posing.parent_of(pose, slot);
            let now = pose.model[slot];
            let moved = Transform { translation: now.translation + moves[frame], ..now };
            row[0].translation = parent.relative(&moved).translation.as_vec3();
        };
        let rows = work.rows(1, || self.posing.pose(), fill)?;
        work.write(&changed, &rows);
        Ok(())
    }
}

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
