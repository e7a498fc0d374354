//! Moves the pelvis until held feet are within reach, and turns it. (docs/algorithm/legs.md.)
//!
//! Hips that are wide for their legs carry the beginnings of the legs far when they turn: a pelvis that rolled and swung as a slender
//! one does would take straight legs off the floor. So it gives way by turning, too: the more, the wider the hips are. What hangs on the
//! pelvis keeps how it is turned.

use std::ops::{Add, Div, Mul};

use glam::{DMat3, DQuat, DVec3};

use super::stage::Stage;
use crate::{
    model::{Canceled, Transform},
    retarget::mapping::Ground,
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
/// Standard deviation of the smoothing of what keeps legs in shape.
const BALANCE_SECONDS: f64 = 0.06;
/// How dear it is to move the pelvis at all, beside turning the bones of a leg that is bent by a right angle.
const STIFFNESS: f64 = 0.1;
/// How much dearer it is to turn the pelvis about the vertical, which says where the figure heads.
const SWING_COST: f64 = 1.5;
/// The pelvis is turned by less than this, in radians: what is missing beyond is left to the legs.
const MAX_TURN: f64 = 0.2;
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
    /// What hangs on the pelvis and keeps how it is turned when that turns; empty where it does not.
    pub(in crate::retarget) kept: Vec<usize>,
    pub(in crate::retarget) legs: Vec<PulledLeg>,
    pub(in crate::retarget) posing: Posing,
    pub(in crate::retarget) ground: Ground,
    pub(in crate::retarget) sideways_cost: f64,
    /// How long the arm is at which a turn of the pelvis is as dear as a move, in plan units; nothing where it does not turn.
    pub(in crate::retarget) turn_arm: Option<f64>,
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

/// What the pelvis is moved by, and about its own joint turned by, as a rotation vector.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Given {
    moved: DVec3,
    turned: DVec3,
}

impl Add for Given {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { moved: self.moved + other.moved, turned: self.turned + other.turned }
    }
}

impl Mul<f64> for Given {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self { moved: self.moved * factor, turned: self.turned * factor }
    }
}

impl Div<f64> for Given {
    type Output = Self;

    fn div(self, divisor: f64) -> Self {
        Self { moved: self.moved / divisor, turned: self.turned / divisor }
    }
}

/// Where a leg begins before the pelvis gives way.
#[derive(Clone, Copy, Debug, Default)]
struct Hip {
    place: DVec3,
    /// From the joint of the pelvis; zero where that does not turn.
    arm: DVec3,
}

impl Hip {
    /// Where it is then.
    fn after(&self, given: &Given) -> DVec3 {
        let swung = DQuat::from_scaled_axis(given.turned) * self.arm - self.arm;
        self.place + given.moved + swung
    }
}

impl PullStage {
    /// Where the legs begin before the pelvis is moved, frame by frame.
    fn hips(&self, work: &Work<'_>) -> Result<Vec<Hip>, Canceled> {
        let pelvis = self.posing.slot(self.pelvis);
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Hip]| {
            self.posing.fill_model(pose, &work.target, frame);
            for (leg, hip) in self.legs.iter().zip(row) {
                let place = pose.model[leg.start].translation;
                let arm = if self.turn_arm.is_some() { place - pose.model[pelvis].translation } else { DVec3::ZERO };
                *hip = Hip { place, arm };
            }
        };
        work.rows(self.legs.len(), || self.posing.pose(), fill)
    }

    /// Adds what lets held legs keep their shape.
    fn balance(&self, given: &mut [Given], hips: &[Hip], work: &Work<'_>) -> Result<(), Canceled> {
        let fill = |(): &mut (), frame: usize, row: &mut [Given]| {
            row[0] = self.balanced(work, hips, frame, given[frame].moved);
        };
        let wanted = work.rows(1, || (), fill)?;
        let wanted = smoothed(&wanted, work.performed, BALANCE_SECONDS);
        for (given, wanted) in given.iter_mut().zip(wanted) {
            let angle = wanted.turned.length() / MAX_TURN;
            let share = if angle > 0.0 { angle.tanh() / angle } else { 0.0 };
            *given = Given { moved: given.moved + wanted.moved, turned: wanted.turned * share };
        }
        Ok(())
    }

    /// The move and turn after which held legs are as long as they were before their feet were moved, as far as that goes for all of them.
    ///
    /// Minimizes `Σ w (u · (x + t × r) − m)² + x · C · x + D t · t`, with `u` from the goal to the hip, `r` from the pelvis to the hip, `m` what
    /// the leg is too short by, `w` how much its bones turn when its length changes: a leg that is nearly straight bends by 8 degrees for
    /// a hundredth of its length.
    fn balanced(&self, work: &Work<'_>, hips: &[Hip], frame: usize, already: DVec3) -> Given {
        let up = self.ground.up;
        let sideways = DMat3::IDENTITY - outer(up, up);
        let mut moves = (outer(up, up) + sideways * self.sideways_cost.powi(2)) * STIFFNESS;
        let (mut turns, mut mixed) = (DMat3::ZERO, DMat3::ZERO);
        let (mut move_wanted, mut turn_wanted) = (DVec3::ZERO, DVec3::ZERO);
        for (leg, hip) in self.legs.iter().zip(&hips[frame * self.legs.len()..]) {
            let goal = &work.goals[frame * self.limb_count + leg.limb];
            let from_goal = hip.place + already - goal.position;
            let Some(away) = from_goal.try_normalize() else { continue };
            let bent = 1.0 - (goal.span / goal.length).clamp(0.0, 1.0).powi(2);
            let weight = goal.hold / (bent + MIN_BENT);
            let lever = hip.arm.cross(away);
            let missing = goal.span - from_goal.length();
            moves += outer(away, away) * weight;
            turns += outer(lever, lever) * weight;
            mixed += outer(away, lever) * weight;
            move_wanted += away * (weight * missing);
            turn_wanted += lever * (weight * missing);
        }
        let Some(turn_arm) = self.turn_arm else {
            return Given { moved: moves.inverse() * move_wanted, turned: DVec3::ZERO };
        };
        turns += (sideways + outer(up, up) * SWING_COST.powi(2)) * (STIFFNESS * turn_arm.powi(2));
        // The block of the moves is eliminated first.
        let inverse = moves.inverse();
        let across = mixed.transpose() * inverse;
        let turned = (turns - across * mixed).inverse() * (turn_wanted - across * move_wanted);
        Given { moved: inverse * (move_wanted - mixed * turned), turned }
    }

    /// Adds what makes held feet reachable, smooth over time.
    fn pull(&self, given: &mut [Given], hips: &[Hip], work: &Work<'_>) -> Result<(), Canceled> {
        // Smoothing takes the tips off, so what is still missing is added again, as smoothly. The little that is left after all
        // rounds is left to the legs: a jolt of the whole body is worse.
        for _ in 0..SMOOTH_ROUNDS {
            let fill = |(): &mut (), frame: usize, row: &mut [DVec3]| {
                row[0] = self.least_move(work, hips, frame, &given[frame]);
            };
            let missing = work.rows(1, || (), fill)?;
            if missing.iter().all(|missing| *missing == DVec3::ZERO) {
                break;
            }
            let more = smoothed(&missing, work.performed, SMOOTHING_SECONDS);
            given.iter_mut().zip(more).for_each(|(given, more)| given.moved += more);
        }
        Ok(())
    }

    /// Feet that are not held go where their hips go, so that their legs keep their shape, as long as they stay out of the floor.
    fn take_along(&self, given: &[Given], shifts: &[DVec3], hips: &[Hip], work: &mut Work<'_>) -> Result<(), Canceled> {
        let up = self.ground.up;
        work.change_goals(self.limb_count, |_, frame, goals| {
            for (leg, hip) in self.legs.iter().zip(&hips[frame * self.legs.len()..]) {
                let goal = &mut goals[leg.limb];
                let along = (hip.after(&given[frame]) - hip.place - shifts[frame]) * (1.0 - goal.hold);
                let height = along.dot(up);
                goal.position += along + up * (height.max(-goal.headroom) - height);
            }
        })
    }

    /// The least move, counting sideways moves dearer, after which every held foot is within reach of its hip.
    fn least_move(&self, work: &Work<'_>, hips: &[Hip], frame: usize, already: &Given) -> DVec3 {
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
                let from_goal = hip.after(already) + moved - goal.position;
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

    /// The pelvis where it goes, and what hangs on it as it was turned.
    fn write(&self, given: &[Given], work: &mut Work<'_>) -> Result<(), Canceled> {
        let slot = self.posing.slot(self.pelvis);
        let pelvis = Changed { joint: self.pelvis, rotates: self.turn_arm.is_some(), moves: true };
        let hanging = self.kept.iter().map(|&joint| Changed { joint, rotates: true, moves: false });
        let changed: Vec<Changed> = std::iter::once(pelvis).chain(hanging).collect();
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.posing.fill_model(pose, &work.target, frame);
            let Given { moved, turned } = given[frame];
            let turn = DQuat::from_scaled_axis(turned);
            let parent = self.posing.parent_of(pose, slot);
            let now = pose.model[slot];
            let then = Transform { translation: now.translation + moved, rotation: turn * now.rotation, ..now };
            let local = parent.relative(&then);
            row[0] = Change { rotation: local.rotation.as_quat(), translation: local.translation.as_vec3() };
            for (joint, change) in self.kept.iter().zip(&mut row[1..]) {
                let slot = self.posing.slot(*joint);
                let above = turn * self.posing.parent_of(pose, slot).rotation;
                change.rotation = (above.conjugate() * pose.model[slot].rotation).normalize().as_quat();
            }
        };
        let rows = work.rows(changed.len(), || self.posing.pose(), fill)?;
        work.write(&changed, &rows);
        Ok(())
    }
}

impl Stage for PullStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut shifts = std::mem::take(&mut work.pelvis_moves);
        shifts.resize(work.frame_count(), DVec3::ZERO);
        let mut given: Vec<Given> = shifts.iter().map(|&moved| Given { moved, turned: DVec3::ZERO }).collect();
        if self.pulls {
            let hips = self.hips(work)?;
            self.balance(&mut given, &hips, work)?;
            self.pull(&mut given, &hips, work)?;
            self.take_along(&given, &shifts, &hips, work)?;
        }
        if given.iter().all(|given| *given == Given::default()) {
            return Ok(());
        }
        self.write(&given, work)
    }
}

/// `a bᵀ`.
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}
