//! Arms that stay out of a body which is thicker than the source's. (docs/algorithm/body.md.)
//!
//! Forearm and hand are capsules, as the parts of the body are. Where one is deeper in the body than the source's is in its own, the arm is
//! swung about its shoulder to the side on which the source's arm is of that part, by the least angle that brings it out. What arms
//! are swung by is smoothed over time, and what is missing then is added as smoothly, in a fixed number of rounds.

pub(in crate::retarget) mod need;
pub(in crate::retarget) mod spec;

pub use self::spec::ArmClearanceOp;

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::schedule::Schedule;
use crate::{
    model::{Canceled, rotation::smootherstep},
    retarget::{
        mapping::{LimbPair, Mapping},
        ops::{
            context::{Context, Limbs},
            op_spec::OpSpec,
            resolved::{OpWork, ResolvedOp},
            scope::Scope,
        },
        stages::{
            builder::StackBuilder,
            gaps::{Fixed, Line, nearest},
            posing::{Pose, Posing},
            stage::Stage,
            temporal::smoothed,
            work::{Change, Changed, Work},
        },
    },
    rig::{Capsule, body_capsules},
};

/// Rounds of swinging arms and smoothing that.
const ROUNDS: usize = 3;
/// Angles of a swing that are tried, radians; between the last two the least is found by halving.
const STEP_RADIANS: f64 = 0.06;
const HALVINGS: usize = 12;
/// An arm that points to where it should go by more than this sine less is not brought there by a swing.
const MIN_SINE: f64 = 0.3;
/// An arm that is farther from the body than the first, in legs, follows what is smoothed over time the less, and not at all beyond the second:
/// the swings of frames around have nothing to say of it.
const NEAR_LEGS: f64 = 0.08;
const FAR_LEGS: f64 = 0.25;
/// Swings of less are none, radians.
const LITTLE_RADIANS: f64 = 1e-4;
/// The parts of an arm that are kept out of the body, behind its side.
const MOVED: [&str; 2] = ["forearm", "hand"];
/// What they are kept out of.
const BODY: [&str; 6] = ["hips", "waist", "chest", "head", "left_thigh", "right_thigh"];

/// Swings arms.
#[derive(Clone, Debug)]
struct ArmClearanceStage {
    op: ArmClearanceOp,
    schedule: Schedule,
    arms: Vec<Arm>,
    body: Vec<Part>,
    source: Posing,
    target: Posing,
    target_leg: f64,
    leg_ratio: f64,
}

/// One arm: slots of the target's upper arm and hand, and the parts that are kept out of the body.
#[derive(Clone, Debug)]
struct Arm {
    upper: usize,
    hand: usize,
    moved: Vec<Part>,
}

/// A part of the body or an arm on both sides.
#[derive(Clone, Debug)]
struct Part {
    source: Fixed,
    target: Fixed,
}

/// How much too deep an arm is.
#[derive(Clone, Copy, Debug)]
struct Depth {
    /// Between the arm and the body; below 0 where they are in one another.
    apart: f64,
    /// Plan units; 0 or less where it is not.
    missing: f64,
    /// On the arm.
    place: DVec3,
    /// To the side on which the arm should be; unit length, or nothing where neither side says it.
    away: DVec3,
}

/// How an arm is to be swung at a frame.
#[derive(Clone, Copy, Debug, Default)]
struct Swing {
    /// A rotation vector about the shoulder.
    by: DVec3,
    /// Between the arm, as it is before anything, and the body, plan units.
    apart: f64,
}

impl ArmClearanceStage {
    /// Where an arm is deepest in the body when it is swung by so much.
    fn depth(&self, arm: &Arm, source: &Pose, target: &Pose, swing: DQuat) -> Depth {
        let shoulder = target.model[arm.upper].translation;
        let mut deepest =
            Depth { apart: f64::INFINITY, missing: f64::NEG_INFINITY, place: shoulder, away: DVec3::ZERO };
        for moved in &arm.moved {
            let line = moved.target.line(target);
            let swung = |place: DVec3| shoulder + swing * (place - shoulder);
            let line = Line { start: swung(line.start), end: swung(line.end), ..line };
            for part in &self.body {
                let own = nearest(&part.target.line(target), &line);
                deepest.apart = deepest.apart.min(own.distance);
                if own.distance >= 0.0 {
                    continue;
                }
                let of_source = nearest(&part.source.line(source), &moved.source.line(source));
                let allowed = of_source.distance.min(0.0) * self.leg_ratio - self.op.depth * self.target_leg;
                if allowed - own.distance > deepest.missing {
                    let away = if of_source.away == DVec3::ZERO { own.away } else { of_source.away };
                    deepest = Depth { missing: allowed - own.distance, place: own.place, away, ..deepest };
                }
            }
        }
        deepest
    }

    /// What an arm is to be swung by beyond what it is.
    fn missing(&self, arm: &Arm, source: &Pose, target: &Pose, already: DVec3) -> Swing {
        let before = DQuat::from_scaled_axis(already);
        let depth = self.depth(arm, source, target, before);
        let none = Swing { by: DVec3::ZERO, apart: depth.apart };
        if depth.missing <= 0.0 {
            return none;
        }
        let lever = depth.place - target.model[arm.upper].translation;
        let axis = lever.normalize_or_zero().cross(depth.away);
        if axis.length() < MIN_SINE {
            return none;
        }
        let axis = axis.normalize();
        let missing =
            |angle: f64| self.depth(arm, source, target, DQuat::from_axis_angle(axis, angle) * before).missing;
        let most = self.op.max_degrees.to_radians() - already.length();
        let (mut best, mut from) = ((depth.missing, 0.0), 0.0);
        while from < most {
            let mut to = (from + STEP_RADIANS).min(most);
            let left = missing(to);
            if left <= 0.0 {
                for _ in 0..HALVINGS {
                    let middle = f64::midpoint(from, to);
                    *(if missing(middle) <= 0.0 { &mut to } else { &mut from }) = middle;
                }
                return Swing { by: axis * to, ..none };
            }
            if left < best.0 {
                best = (left, to);
            }
            from = to;
        }
        Swing { by: axis * best.1, ..none }
    }

    /// How much an arm follows what is smoothed over time.
    fn nearness(&self, apart: f64) -> f64 {
        1.0 - smootherstep((apart / self.target_leg - NEAR_LEGS) / (FAR_LEGS - NEAR_LEGS))
    }
}

impl Stage for ArmClearanceStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.arms.len();
        let mut swings: Vec<Swing> = Vec::new();
        for _ in 0..ROUNDS {
            let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Swing]| {
                self.source.fill_model(source, work.source, frame);
                self.target.fill_model(target, &work.target, frame);
                for (index, arm) in self.arms.iter().enumerate() {
                    let already = swings.get(frame * width + index).copied().unwrap_or_default();
                    row[index] = self.missing(arm, source, target, already.by);
                }
            };
            let missing = work.rows(width, || (self.source.pose(), self.target.pose()), fill)?;
            if missing.iter().all(|swing| swing.by == DVec3::ZERO) {
                break;
            }
            if swings.is_empty() {
                swings.extend(missing.iter().map(|first| Swing { by: DVec3::ZERO, ..*first }));
            }
            let smooth = |arm: usize| {
                let more: Vec<DVec3> = missing.iter().skip(arm).step_by(width).map(|swing| swing.by).collect();
                smoothed(&more, work.performed, self.op.smoothing_seconds)
            };
            let more: Vec<Vec<DVec3>> = (0..width).into_par_iter().map(smooth).collect();
            for (index, swing) in swings.iter_mut().enumerate() {
                swing.by += more[index % width][index / width] * self.nearness(swing.apart);
            }
        }
        for (index, arm) in self.arms.iter().enumerate() {
            let by = |frame: usize| swings[frame * width + index].by;
            if !swings.is_empty() && (0..work.frame_count()).any(|frame| by(frame).length() > LITTLE_RADIANS) {
                self.swing(arm, by, work)?;
            }
        }
        Ok(())
    }
}

impl ArmClearanceStage {
    /// Turns the upper arm, and the hand back.
    fn swing(&self, arm: &Arm, by: impl Fn(usize) -> DVec3 + Sync, work: &mut Work<'_>) -> Result<(), Canceled> {
        let changed =
            [arm.upper, arm.hand].map(|slot| Changed { joint: self.target.joint(slot), rotates: true, moves: false });
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Change]| {
            self.target.fill_model(pose, &work.target, frame);
            let swing = DQuat::from_scaled_axis(by(frame) * self.schedule.alpha_at(work.moment(frame)));
            let above = |slot: usize| self.target.parent_of(pose, slot).rotation;
            let [upper, hand] = [arm.upper, arm.hand].map(|slot| pose.model[slot].rotation);
            row[0].rotation = (above(arm.upper).conjugate() * (swing * upper)).normalize().as_quat();
            row[1].rotation = ((swing * above(arm.hand)).conjugate() * hand).normalize().as_quat();
        };
        let rows = work.rows(changed.len(), || self.target.pose(), fill)?;
        work.write(&changed, &rows);
        Ok(())
    }
}

/// An op, its arms and the body.
#[derive(Clone, Debug)]
struct ResolvedArmClearance {
    op: ArmClearanceOp,
    arms: Vec<ResolvedArm>,
    body: Vec<Pair>,
}

/// Joints of the target, and the parts of both sides.
#[derive(Clone, Debug)]
struct ResolvedArm {
    /// Which of the mapping's limbs it is.
    limb: usize,
    upper: usize,
    hand: usize,
    moved: Vec<Pair>,
}

/// A part of source and target, in plan units.
type Pair = [Capsule; 2];

impl OpWork for ResolvedArmClearance {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let stage = self.stage(op, stack);
        stack.push_posed(stage);
    }

    fn changed(&self, op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        self.arms_of(op).flat_map(|arm| [arm.upper, arm.hand]).collect()
    }
}

impl ResolvedArmClearance {
    /// Those that the op is about.
    fn arms_of<'s>(&'s self, op: &'s ResolvedOp) -> impl Iterator<Item = &'s ResolvedArm> {
        self.arms.iter().filter(|arm| op.limbs.contains(&arm.limb))
    }

    /// Nothing where there are no arms, or nothing that they could be in.
    fn stage(&self, op: &ResolvedOp, stack: &StackBuilder<'_>) -> Option<ArmClearanceStage> {
        let resolved: Vec<&ResolvedArm> = self.arms_of(op).collect();
        if resolved.is_empty() || self.body.is_empty() {
            return None;
        }
        let pairs = || resolved.iter().flat_map(|arm| &arm.moved).chain(&self.body);
        let joints = |side: usize| pairs().flat_map(move |pair| [pair[side].start.joint, pair[side].end.joint]);
        let source = stack.source_posing(joints(0));
        let target = stack.target_posing(joints(1).chain(resolved.iter().flat_map(|arm| [arm.upper, arm.hand])));
        let part = |pair: &Pair| Part { source: Fixed::new(&pair[0], &source), target: Fixed::new(&pair[1], &target) };
        let arm = |arm: &&ResolvedArm| Arm {
            upper: target.slot(arm.upper),
            hand: target.slot(arm.hand),
            moved: arm.moved.iter().map(part).collect(),
        };
        let (arms, body) = (resolved.iter().map(arm).collect(), self.body.iter().map(part).collect());
        let (source_leg, target_leg) = stack.legs();
        Some(ArmClearanceStage {
            op: self.op.clone(),
            schedule: op.schedule.clone(),
            arms,
            body,
            source,
            target,
            target_leg,
            leg_ratio: target_leg / source_leg,
        })
    }
}

impl OpSpec for ArmClearanceOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let Context { source, target, .. } = *context;
        let unit = source.unit_meters / target.unit_meters;
        let of_source = body_capsules(source).into_iter().map(|(name, capsule)| (name, capsule.in_unit(unit)));
        let of_source: Vec<(&str, Capsule)> = of_source.collect();
        let of_target = body_capsules(target);
        let pair = |name: &str| -> Option<Pair> {
            let of = |side: &[(&str, Capsule)]| side.iter().find(|(other, _)| *other == name).map(|(_, part)| *part);
            Some([of(&of_source)?, of(&of_target)?])
        };
        let arm = |(limb, pair_of_limbs): (usize, &LimbPair)| {
            let side = pair_of_limbs.limb.side_of_arm()?;
            let joint = |part: &str| target.role(&format!("{side}{part}")).first().copied();
            let moved: Vec<Pair> = MOVED.iter().filter_map(|part| pair(&format!("{side}{part}"))).collect();
            Some(ResolvedArm { limb, upper: joint("upper_arm")?, hand: joint("hand")?, moved })
        };
        let arms = context.limbs.iter().enumerate().filter_map(arm).collect();
        let body = BODY.into_iter().filter_map(pair).collect();
        context.push_on_limbs(&self.scope, Limbs::Arms, ResolvedArmClearance { op: self.clone(), arms, body });
    }
}
