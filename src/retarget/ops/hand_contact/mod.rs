//! Hands that touch each other in the source do so on the target. (docs/algorithm/body.md.)
//!
//! Forward kinematics keeps the directions of arms. With arms of other lengths, or shoulders that are wider or narrower, hands that are held
//! together come apart by that, or go through one another. Where the source's palms are near, the target's are led to the same distance
//! and direction from each other. What hands are moved by is smoothed over time, and what the smoothing took off is added again, as
//! smoothly.

pub(in crate::retarget) mod spec;

pub use self::spec::HandContactOp;

use glam::DVec3;

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
            gaps::{Fixed, Line},
            moved_arm::MovedArm,
            posing::{Pose, Posing},
            stage::Stage,
            temporal::smoothed,
            work::Work,
        },
    },
    rig::{Capsule, Limb, palm},
};

/// Hands that are no farther apart are led all the way, in legs; no farther than half of the reach.
const TOUCH_LEGS: f64 = 0.08;
/// How much the middle of a hand is preferred, in lengths of its line.
const MIDDLE: f64 = 0.1;
/// Rounds of leading hands to where they should be and smoothing that.
const ROUNDS: usize = 2;
/// What is moved by less, in legs, stays as it is.
const LITTLE_LEGS: f64 = 1e-4;

/// Leads two hands to each other.
#[derive(Clone, Debug)]
struct HandContactStage {
    op: HandContactOp,
    schedule: Schedule,
    /// Of the left hand and the right one.
    hands: [Hand; 2],
    source: Posing,
    target: Posing,
    source_leg: f64,
    target_leg: f64,
}

/// How the source's hands are to each other at a frame.
#[derive(Clone, Copy, Debug, Default)]
struct Meeting {
    /// Where along the left hand and the right one they are nearest.
    shares: [f64; 2],
    /// From there on the right one to there on the left one.
    between: DVec3,
    /// 1 where they touch, 0 where they are out of reach.
    near: f64,
}

/// One of the two hands.
#[derive(Clone, Debug)]
struct Hand {
    arm: MovedArm,
    /// The palms of both sides.
    source: Fixed,
    target: Fixed,
    /// How much of the way it goes.
    share: f64,
}

impl HandContactStage {
    /// How near the hands of the source are: 1 where they touch, 0 beyond the reach. For the distance between their surfaces.
    fn nearness(&self, apart: f64) -> f64 {
        let touch = TOUCH_LEGS.min(self.op.reach / 2.0);
        let fade = (self.op.reach - touch).max(f64::MIN_POSITIVE);
        1.0 - smootherstep((apart / self.source_leg - touch) / fade)
    }

    /// How the hands of the source are to each other.
    fn of_source(&self, pose: &Pose) -> Meeting {
        let [left, right] = self.hands.each_ref().map(|hand| hand.source.line(pose));
        let shares = nearest_shares(&left, &right);
        let between = left.at(shares[0]) - right.at(shares[1]);
        Meeting { shares, between, near: self.nearness(between.length() - left.radius - right.radius) }
    }

    /// What is missing between the hands of the target, from the right one to the left one.
    fn missing(&self, Meeting { shares, between, .. }: Meeting, pose: &Pose) -> DVec3 {
        let thick = |palm: fn(&Hand) -> &Fixed| self.hands.iter().map(|hand| palm(hand).radius).sum::<f64>();
        let (source, target) = (thick(|hand| &hand.source), thick(|hand| &hand.target));
        // In proportion to the hands as far as they touch, to the legs beyond.
        let apart = between.length();
        let beyond = (apart - source).max(0.0);
        let wanted = (apart - beyond) * target / source + beyond * self.target_leg / self.source_leg;
        let [left, right] = self.hands.each_ref().map(|hand| hand.target.line(pose));
        between.normalize_or_zero() * wanted - (left.at(shares[0]) - right.at(shares[1]))
    }

    /// What is to be added from the right palm to the left one at every frame; nothing where hands stay apart.
    fn moves(&self, work: &Work<'_>) -> Result<Option<Vec<DVec3>>, Canceled> {
        let near = |pose: &mut Pose, frame: usize, row: &mut [Meeting]| {
            self.source.fill_model(pose, work.source, frame);
            row[0] = self.of_source(pose);
        };
        let near = work.rows(1, || self.source.pose(), near)?;
        if near.iter().all(|meeting| meeting.near <= 0.0) {
            return Ok(None);
        }
        let missing = |pose: &mut Pose, frame: usize, row: &mut [DVec3]| {
            if near[frame].near > 0.0 {
                self.target.fill_model(pose, &work.target, frame);
                row[0] = self.missing(near[frame], pose);
            }
        };
        let missing = work.rows(1, || self.target.pose(), missing)?;
        let mut moves = vec![DVec3::ZERO; missing.len()];
        for _ in 0..ROUNDS {
            let left = moves.iter().zip(&missing).zip(&near);
            let left: Vec<DVec3> =
                left.map(|((moved, missing), Meeting { near, .. })| (*missing * *near - *moved) * *near).collect();
            let more = smoothed(&left, work.performed, self.op.smoothing_seconds);
            moves.iter_mut().zip(more).for_each(|(moved, more)| *moved += more);
        }
        Ok(Some(moves))
    }
}

/// The shares of both lines at which two hands are near each other: where the lines are nearest, but the middle of a hand, where its line ends, is
/// preferred, since lines that run beside each other are nearest anywhere.
fn nearest_shares(left: &Line, right: &Line) -> [f64; 2] {
    let (along_left, along_right, apart) = (left.end - left.start, right.end - right.start, left.start - right.start);
    let preferred = MIDDLE * f64::midpoint(along_left.length_squared(), along_right.length_squared());
    // The least of |apart + s·left − t·right|² + preferred·((1 − s)² + (1 − t)²), for one share at a time where the other one is at an end.
    let (of_left, of_right) = (along_left.length_squared() + preferred, along_right.length_squared() + preferred);
    let together = along_left.dot(along_right);
    let (left_wants, right_wants) = (preferred - apart.dot(along_left), preferred + apart.dot(along_right));
    let share = |above: f64, below: f64| if below > 0.0 { (above / below).clamp(0.0, 1.0) } else { 1.0 };
    let first = share(left_wants * of_right + together * right_wants, of_left * of_right - together * together);
    let second = share(right_wants + together * first, of_right);
    [share(left_wants + together * second, of_left), second]
}

impl Stage for HandContactStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let Some(moves) = self.moves(work)? else { return Ok(()) };
        let alphas: Vec<f64> = (0..moves.len()).map(|frame| self.schedule.alpha_at(work.moment(frame))).collect();
        let little = LITTLE_LEGS * self.target_leg;
        for (hand, side) in self.hands.iter().zip([1.0, -1.0]) {
            let wanted = |frame: usize| moves[frame] * (side * hand.share * alphas[frame]);
            let bends = |pose: &Pose, _: usize| hand.arm.bends(pose);
            hand.arm.lead_wrist(&self.target, wanted, bends, little, work)?;
        }
        Ok(())
    }
}

/// An op and the palms of both hands, left and right.
#[derive(Clone, Debug)]
struct ResolvedHandContact {
    op: HandContactOp,
    /// Limbs of the mapping, and the palms of source and target in plan units; nothing where there are no two hands.
    hands: Option<[(usize, [Capsule; 2]); 2]>,
}

impl OpWork for ResolvedHandContact {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let stage = self.stage(op, stack);
        stack.push_posed(stage);
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        op.limb_joints(mapping, false)
    }
}

impl ResolvedHandContact {
    fn stage(&self, op: &ResolvedOp, stack: &StackBuilder<'_>) -> Option<HandContactStage> {
        let hands = self.hands.as_ref()?;
        let moved = hands.iter().filter(|(limb, _)| op.limbs.contains(limb)).count();
        if moved == 0 {
            return None;
        }
        let source = stack.source_posing(hands.iter().map(|(_, palms)| palms[0].start.joint));
        let of_target = |(limb, palms): &(usize, [Capsule; 2])| {
            stack.limb(*limb).target.joints().into_iter().chain([palms[1].start.joint])
        };
        let target = stack.target_posing(hands.iter().flat_map(of_target));
        let hand = |(limb, palms): &(usize, [Capsule; 2])| Hand {
            arm: stack.moved_arm(stack.limb(*limb), true, &target),
            source: Fixed::new(&palms[0], &source),
            target: Fixed::new(&palms[1], &target),
            share: if op.limbs.contains(limb) { 1.0 / moved as f64 } else { 0.0 },
        };
        let (source_leg, target_leg) = stack.legs();
        Some(HandContactStage {
            op: self.op.clone(),
            schedule: op.schedule.clone(),
            hands: hands.each_ref().map(hand),
            source,
            target,
            source_leg,
            target_leg,
        })
    }
}

impl OpSpec for HandContactOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let Context { source, target, .. } = *context;
        let unit = source.unit_meters / target.unit_meters;
        let hand = |arm: Limb| {
            let limb = context.limbs.iter().position(|pair: &LimbPair| pair.limb == arm)?;
            Some((limb, [palm(source, arm)?.in_unit(unit), palm(target, arm)?]))
        };
        let hands = hand(Limb::LeftArm).zip(hand(Limb::RightArm)).map(|(left, right)| [left, right]);
        context.push_on_limbs(&self.scope, Limbs::Arms, ResolvedHandContact { op: self.clone(), hands });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(start: DVec3, end: DVec3) -> Line {
        Line { start, end, radius: 0.02 }
    }

    #[test]
    fn hands_meet_where_their_lines_cross() {
        // Crossed at the wrists: the left one goes to the right, the right one to the left.
        let left = line(DVec3::new(0.01, 0.0, 0.05), DVec3::new(-0.09, 0.0, 0.05));
        let right = line(DVec3::new(-0.01, 0.0, 0.0), DVec3::new(0.09, 0.0, 0.0));
        let [of_left, of_right] = nearest_shares(&left, &right);
        assert!(of_left < 0.5 && (of_left - of_right).abs() < 1e-12, "{of_left} and {of_right}");
        // A hand whose middle is at the other one's wrist.
        let across = line(DVec3::new(0.0, 0.1, 0.0), DVec3::ZERO);
        let [of_left, of_right] =
            nearest_shares(&across, &line(DVec3::new(0.0, 0.0, 0.02), DVec3::new(0.1, 0.0, 0.02)));
        assert!(of_left > 0.9 && of_right < 0.2, "{of_left} and {of_right}");
    }

    #[test]
    fn hands_beside_each_other_meet_in_the_middle() {
        let left = line(DVec3::X * 0.03, DVec3::new(0.03, 0.0, 0.1));
        let right = line(DVec3::X * -0.03, DVec3::new(-0.03, 0.0, 0.1));
        assert!(nearest_shares(&left, &right).into_iter().all(|share| share > 1.0 - 1e-12), "folded hands");
        let point = line(DVec3::ZERO, DVec3::ZERO);
        assert_eq!(nearest_shares(&point, &point), [1.0, 1.0], "hands without a length");
    }
}
