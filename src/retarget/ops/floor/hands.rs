//! Hands on the floor, where the source's are, and never in it.
//!
//! How high a hand is over the floor depends on the length of trunk and arms: where a body sits, crouches or crawls, hands that lie on the
//! floor on the source would be in it on the target, or above. The wrist is moved up or down, by what the lowest point of hand and fingers is
//! off by, and the elbow bends; the hand keeps its turn. Hands in the air are only kept out of the floor.

use crate::{
    model::{Canceled, rotation::smootherstep},
    retarget::{
        mapping::Ground,
        ops::schedule::Schedule,
        stages::{
            moved_arm::MovedArm,
            posing::{Pose, Posing},
            ride::RideStage,
            stage::Stage,
            work::Work,
        },
    },
};

use super::{Surface, smooth_above, trunk::SUNK_LEGS};

/// A hand of the source that is no higher over the floor touches it, in legs; and over how much that ceases.
const TOUCHES_LEGS: f64 = 0.02;
const TOUCHES_FADE_LEGS: f64 = 0.08;
/// Hands that hang lower as the figure stands, in legs, touch the floor the less on purpose: it says less of others.
const HANGS_LEGS: f64 = 0.15;
/// A hand is moved down by no more, in legs of the target.
const MAX_LOWER_LEGS: f64 = 0.15;
/// Standard deviation of the smoothing of what hands are moved by.
const LIFT_SECONDS: f64 = 0.06;
/// What is moved by less, in legs, stays as it is.
const LITTLE_LEGS: f64 = 1e-5;
/// Hands that go along with their forearms turn as those are raised: what is then in the floor by more, in legs, is raised again so often.
const LEFT_LEGS: f64 = 1e-3;
const ROUNDS: usize = 3;

/// Moves hands up and down.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct HandStage {
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) hands: Vec<FloorHand>,
    /// The joints of the target that carry arms.
    pub(in crate::retarget) carriers: Posing,
    pub(in crate::retarget) ground: Ground,
    pub(in crate::retarget) source_leg: f64,
    pub(in crate::retarget) target_leg: f64,
    /// Whether the target is the source's figure.
    pub(in crate::retarget) is_same: bool,
    /// What rides arms and hands.
    pub(in crate::retarget) riders: Option<RideStage>,
}

/// A hand of both sides.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FloorHand {
    /// The arm of the target, by slots of the target's surface.
    pub(in crate::retarget) arm: MovedArm,
    pub(in crate::retarget) source: Surface,
    pub(in crate::retarget) target: Surface,
    /// Slot of a joint that carries the arm in the stage's posing, and how far below that the hand can be.
    pub(in crate::retarget) carrier: usize,
    pub(in crate::retarget) reach: f64,
    /// How high the source's hand can be over the floor at rest where its arm hangs down.
    pub(in crate::retarget) hangs: f64,
}

/// How far a hand is to be moved up.
#[derive(Clone, Copy, Debug, Default)]
struct Move {
    wanted: f64,
    /// What it has to be moved by to stay out of the floor.
    least: f64,
}

impl HandStage {
    /// Whether each hand may be at the floor, frame by frame; none where the figure is in it, as in clips that fall below it.
    fn near(&self, work: &Work<'_>) -> Result<Vec<bool>, Canceled> {
        let sunk = self.ground.source_floor - SUNK_LEGS * self.source_leg;
        let is_sunk =
            |frame: usize| work.source_soles.iter().any(|soles| soles.get(frame).is_some_and(|sole| *sole < sunk));
        let fill = |pose: &mut Pose, frame: usize, row: &mut [bool]| {
            if is_sunk(frame) {
                return;
            }
            self.carriers.fill_model(pose, &work.target, frame);
            for (hand, is_near) in self.hands.iter().zip(row) {
                let height = pose.model[hand.carrier].translation.dot(self.ground.up);
                *is_near = height - hand.reach < self.ground.target_floor;
            }
        };
        work.rows(self.hands.len(), || self.carriers.pose(), fill)
    }

    /// What a hand is to be moved by at every frame; nothing where it stays where it is. `is_near` says whether it may be at the floor. In further
    /// rounds it is only brought out of the floor.
    fn moves(
        &self,
        hand: &FloorHand,
        round: usize,
        is_near: impl Fn(usize) -> bool + Sync + Send,
        work: &Work<'_>,
    ) -> Result<Option<Vec<f64>>, Canceled> {
        let (up, ground) = (self.ground.up, &self.ground);
        let fill = |poses: &mut (Pose, Pose), frame: usize, row: &mut [Move]| {
            row[0] = Move { wanted: 0.0, least: f64::NEG_INFINITY };
            if !is_near(frame) {
                return;
            }
            hand.source.posing.fill_model(&mut poses.0, work.source, frame);
            hand.target.posing.fill_model(&mut poses.1, &work.target, frame);
            let source = hand.source.lowest(|slot| &poses.0.model[slot], up) - ground.source_floor;
            let target = hand.target.lowest(|slot| &poses.1.model[slot], up) - ground.target_floor;
            row[0] = self.wanted(hand, source / self.source_leg, target / self.target_leg);
            if round > 0 {
                row[0].wanted = row[0].least.max(0.0);
            }
        };
        let rows = work.rows(1, || (hand.source.posing.pose(), hand.target.posing.pose()), fill)?;
        let alpha = |frame: usize| self.schedule.alpha_at(work.moment(frame));
        let alphas: Vec<f64> = (0..rows.len()).map(alpha).collect();
        // Nothing times what is endless is no number.
        let share = |alpha: &f64| alpha.max(f64::MIN_POSITIVE) * self.target_leg;
        let scaled = |pick: fn(&Move) -> f64| -> Vec<f64> {
            rows.iter().zip(&alphas).map(|(row, alpha)| pick(row) * share(alpha)).collect()
        };
        let moves = smooth_above(&scaled(|row| row.wanted), &scaled(|row| row.least), work.performed, LIFT_SECONDS);
        let little = if round > 0 { LEFT_LEGS } else { LITTLE_LEGS };
        let is_little = |moved: &f64| moved.abs() < little * self.target_leg;
        Ok((!moves.iter().all(is_little)).then_some(moves))
    }

    /// For the heights of the lowest points of both hands over their floors, in legs.
    fn wanted(&self, hand: &FloorHand, source: f64, target: f64) -> Move {
        let least = if self.is_same { source.min(0.0) } else { 0.0 } - target;
        let touches = 1.0 - smootherstep((source - TOUCHES_LEGS) / TOUCHES_FADE_LEGS);
        let touches = touches * smootherstep(hand.hangs / HANGS_LEGS);
        let height = if self.is_same { source } else { source.max(0.0) };
        let wanted = ((height - target) * touches).max(-MAX_LOWER_LEGS);
        Move { wanted: wanted.max(least), least }
    }
}

impl Stage for HandStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        // On stairs and slopes nobody knows where the floor is below the hands.
        if work.contacts.level_below_raised_ground.is_some() {
            return Ok(());
        }
        let near = self.near(work)?;
        if !near.contains(&true) {
            return Ok(());
        }
        let mut is_moved = false;
        for (index, hand) in self.hands.iter().enumerate() {
            let is_near = |frame: usize| near[frame * self.hands.len() + index];
            for round in 0..ROUNDS {
                let Some(moves) = self.moves(hand, round, is_near, work)? else { break };
                let by = |frame: usize| self.ground.up * moves[frame];
                hand.arm.move_wrist(&hand.target.posing, by, LITTLE_LEGS * self.target_leg, work)?;
                is_moved = true;
            }
        }
        match &self.riders {
            Some(riders) if is_moved => riders.run(work),
            _ => Ok(()),
        }
    }
}
