//! Hands that touch the body touch it on the target as well. (docs/algorithm/body.md.)
//!
//! For every frame the place of each hand about each part of the body is read from the source: how far along the part, on which
//! side, how far from its surface. That place on the target is what the hand is led to, the more the nearer the source's is. What hands
//! are moved by is smoothed over time. Then hands are brought out of the body where they are still in it, as far as they have to and as smoothly. An arm
//! that is nearly straight only swings.

pub(in crate::retarget) mod spec;

pub use self::spec::SelfContactOp;

use glam::DVec3;
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
            gaps::{Fixed, Gap, Line, between},
            moved_arm::MovedArm,
            posing::{Pose, Posing},
            stage::Stage,
            temporal::{smoothed, smoothed_above},
            work::Work,
        },
    },
    rig::{
        BodyPart, Capsule, HandPair, Limb,
        rig::Rig,
        volumes::{body_parts, hand},
    },
};

/// How often hands are led to what they touch: arms are a part of the body, too, and what they touch moves with them; what the smoothing took off
/// is added again. Fewer leave the short touches of a boxer apart, and of many times nothing would be left of the smoothing.
const PASSES: usize = 4;
/// How often they are brought out of the body after that.
const SETTLING_PASSES: usize = 2;
/// Where a way that is smooth over time leads out by less than this share, it is taken for that much.
const MIN_COSINE: f64 = 0.5;
/// Rounds of pushing a hand out of all parts, one after the other.
const PUSHES: usize = 3;
/// The arms of a body.
const MAX_HANDS: usize = 2;
/// What is moved by less, in legs, stays as it is.
const LITTLE_LEGS: f64 = 1e-6;

/// Leads hands.
#[derive(Clone, Debug)]
struct SelfContactStage {
    op: SelfContactOp,
    schedule: Schedule,
    hands: Vec<Hand>,
    parts: Vec<Part>,
    source: Posing,
    target: Posing,
    /// Length of the source's leg and the target's in plan units.
    source_leg: f64,
    target_leg: f64,
}

/// A hand of both sides; a ball.
#[derive(Clone, Debug)]
struct Hand {
    limb: usize,
    arm: MovedArm,
    source: Fixed,
    target: Fixed,
}

/// A part of the body of both sides.
#[derive(Clone, Debug)]
struct Part {
    /// The limb that it is a part of; its own hand does not look at it.
    own: Option<usize>,
    source: Fixed,
    target: Fixed,
}

/// Of an arm at a frame before anything is moved.
#[derive(Clone, Copy, Debug, Default)]
struct Before {
    wrist: DVec3,
    /// How much of what its wrist is moved by its elbow may bend for.
    bends: f64,
}

/// What hands are to be moved by at a frame.
type Moves = [DVec3; MAX_HANDS];

impl SelfContactStage {
    /// What hands are to be moved by.
    fn wanted(&self, source: &Pose, target: &Pose, settles: bool) -> Moves {
        let mut of_source = [Line::default(); MAX_HANDS];
        let mut of_target = [Line::default(); MAX_HANDS];
        for (index, hand) in self.hands.iter().enumerate() {
            of_source[index] = hand.source.line(source);
            of_target[index] = hand.target.line(target);
        }
        let mut led = [Led::default(); MAX_HANDS];
        let mut moves = [DVec3::ZERO; MAX_HANDS];
        let hands = self.hands.len();
        if hands == MAX_HANDS {
            let gap = between(&of_source[1], of_source[0].start, of_source[0].radius);
            let apart = of_target[0].start - of_target[1].start;
            let wanted = gap.away
                * (of_target[0].radius
                    + of_target[1].radius
                    + self.kept(&gap, of_source[0].radius, of_target[0].radius));
            let missing = (wanted - apart) / 2.0;
            led[0].add(missing, self.nearness(&gap));
            led[1].add(-missing, self.nearness(&gap));
        }
        for (index, hand) in self.hands.iter().enumerate() {
            for part in self.parts.iter().filter(|part| part.own != Some(hand.limb)) {
                let (from, onto) = (part.source.line(source), part.target.line(target));
                let gap = between(&from, of_source[index].start, of_source[index].radius);
                let near = self.nearness(&gap);
                if near <= 0.0 {
                    continue;
                }
                let kept = self.kept(&gap, from.radius, onto.radius);
                let place = onto.at(gap.share) + gap.away * (onto.radius + of_target[index].radius + kept);
                led[index].add(place - of_target[index].start, near);
            }
            if self.op.keep_touch && !settles {
                moves[index] = led[index].mean();
            }
        }
        if self.op.push_out {
            for index in 0..hands {
                moves[index] += self.pushed(index, &of_source[index], &of_target[index], moves[index], source, target);
            }
        }
        moves
    }

    /// What brings a hand that is moved by `moved` out of all parts.
    fn pushed(&self, hand: usize, from: &Line, onto: &Line, moved: DVec3, source: &Pose, target: &Pose) -> DVec3 {
        let mut pushed = DVec3::ZERO;
        for _ in 0..PUSHES {
            let mut is_free = true;
            for part in self.parts.iter().filter(|part| part.own != Some(self.hands[hand].limb)) {
                let body = part.target.line(target);
                let gap = between(&body, onto.start + moved + pushed, onto.radius);
                if gap.distance >= 0.0 {
                    continue;
                }
                let own = between(&part.source.line(source), from.start, from.radius);
                let allowed = own.distance.min(0.0) * body.radius / part.source.radius;
                if gap.distance < allowed - 1e-9 * body.radius {
                    is_free = false;
                    pushed += gap.away * (allowed - gap.distance);
                }
            }
            if is_free {
                break;
            }
        }
        pushed
    }

    /// 1 where surfaces touch, 0 where they are out of reach of each other.
    fn nearness(&self, gap: &Gap) -> f64 {
        smootherstep(1.0 - gap.distance.max(0.0) / (self.op.reach * self.source_leg).max(f64::MIN_POSITIVE))
    }

    /// The gap on the target: in proportion to the radii where it is small, to the legs where it is large. No gap stays none.
    fn kept(&self, gap: &Gap, source_radius: f64, target_radius: f64) -> f64 {
        let near = self.nearness(gap);
        gap.distance * (target_radius / source_radius * near + self.target_leg / self.source_leg * (1.0 - near))
    }
}

impl SelfContactStage {
    /// What hands are to be moved by, frame by frame.
    fn missing(&self, work: &Work<'_>, settles: bool) -> Result<Vec<Moves>, Canceled> {
        let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Moves]| {
            self.source.fill_model(source, work.source, frame);
            self.target.fill_model(target, &work.target, frame);
            row[0] = self.wanted(source, target, settles);
        };
        work.rows(1, || (self.source.pose(), self.target.pose()), fill)
    }

    /// What leads each hand to what it touches, smoothly.
    fn led(&self, work: &Work<'_>) -> Result<Vec<Vec<DVec3>>, Canceled> {
        let missing = self.missing(work, false)?;
        let smooth = |hand: usize| {
            let missing: Vec<DVec3> = missing.iter().map(|missing| missing[hand]).collect();
            smoothed(&missing, work.performed, self.op.smoothing_seconds)
        };
        Ok((0..self.hands.len()).into_par_iter().map(smooth).collect())
    }

    /// What brings a hand out of the body wherever it is in it: at least as far as it has to, and smooth.
    fn out(&self, hand: usize, work: &Work<'_>) -> Result<Vec<DVec3>, Canceled> {
        let missing: Vec<DVec3> = self.missing(work, true)?.iter().map(|missing| missing[hand]).collect();
        let (times, seconds) = (work.performed, self.op.smoothing_seconds);
        let mut ways = smoothed(&missing, times, seconds);
        ways.iter_mut().for_each(|way| *way = way.normalize_or_zero());
        let far = |(way, missing): (&DVec3, &DVec3)| {
            let length = missing.length();
            if length > 0.0 { length / way.dot(*missing / length).max(MIN_COSINE) } else { 0.0 }
        };
        let far: Vec<f64> = ways.iter().zip(&missing).map(far).collect();
        let far = smoothed_above(&far, times, seconds);
        Ok(ways.into_iter().zip(far).map(|(way, far)| way * far).collect())
    }

    /// How all arms are, frame by frame, at so many a frame.
    fn before(&self, work: &Work<'_>) -> Result<Vec<Before>, Canceled> {
        let fill = |pose: &mut Pose, frame: usize, row: &mut [Before]| {
            self.target.fill_model(pose, &work.target, frame);
            for (hand, before) in self.hands.iter().zip(row) {
                let [_, _, wrist] = hand.arm.limb.slots.places(pose);
                *before = Before { wrist, bends: hand.arm.bends(pose) };
            }
        };
        work.rows(self.hands.len(), || self.target.pose(), fill)
    }

    /// Moves the wrist of a hand by so much at every frame, as its arm can.
    fn lead(
        &self,
        hand: usize,
        by: impl Fn(usize) -> DVec3 + Sync,
        before: &[Before],
        work: &mut Work<'_>,
    ) -> Result<(), Canceled> {
        let bends = |_: &Pose, frame: usize| before[frame * self.hands.len() + hand].bends;
        self.hands[hand].arm.lead_wrist(&self.target, by, bends, LITTLE_LEGS * self.target_leg, work)
    }
}

impl Stage for SelfContactStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let width = self.hands.len();
        let before = self.before(work)?;
        let alphas: Vec<f64> =
            (0..work.frame_count()).map(|frame| self.schedule.alpha_at(work.moment(frame))).collect();
        let at = |moved: DVec3, frame: usize| if alphas[frame] > 0.0 { moved } else { DVec3::ZERO };
        for _ in 0..PASSES {
            let moves = self.led(work)?;
            for (hand, moves) in moves.iter().enumerate() {
                self.lead(hand, |frame| at(moves[frame], frame), &before, work)?;
            }
        }
        // What one hand does moves the arm that the other one lies on: one after the other.
        for hand in (0..SETTLING_PASSES).flat_map(|_| 0..width) {
            let out = self.out(hand, work)?;
            self.lead(hand, |frame| at(out[frame], frame), &before, work)?;
        }
        if alphas.iter().all(|alpha| *alpha == 0.0 || *alpha == 1.0) {
            return Ok(());
        }
        // Where the op has a share only, hands go back by the rest of what they were moved.
        let after = self.before(work)?;
        for hand in 0..width {
            let moved = |frame: usize| after[frame * width + hand].wrist - before[frame * width + hand].wrist;
            let back =
                |frame: usize| if alphas[frame] > 0.0 { moved(frame) * (alphas[frame] - 1.0) } else { DVec3::ZERO };
            self.lead(hand, back, &before, work)?;
        }
        Ok(())
    }
}

/// A mean of places that a hand should be at, where the nearest part counts most.
#[derive(Clone, Copy, Debug, Default)]
struct Led {
    sum: DVec3,
    weights: f64,
    most: f64,
}

impl Led {
    fn add(&mut self, missing: DVec3, near: f64) {
        let weight = near.powi(4);
        self.sum += missing * weight;
        self.weights += weight;
        self.most = self.most.max(near);
    }

    fn mean(&self) -> DVec3 {
        if self.weights > 0.0 { self.sum / self.weights * self.most } else { DVec3::ZERO }
    }
}

/// A `self_contact` op, what hands may touch, and the hands.
#[derive(Clone, Debug)]
struct ResolvedSelfContact {
    op: SelfContactOp,
    parts: Vec<BodyPart>,
    hands: Vec<HandPair>,
}

impl OpWork for ResolvedSelfContact {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let stage = self.stage(op, stack);
        stack.push_posed(stage);
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        op.limb_joints(mapping, false)
    }
}

impl ResolvedSelfContact {
    /// Nothing where there is no hand, or nothing that it could touch.
    fn stage(&self, op: &ResolvedOp, stack: &StackBuilder<'_>) -> Option<SelfContactStage> {
        let pairs: Vec<&HandPair> = self.hands.iter().filter(|hand| op.limbs.contains(&hand.limb)).collect();
        if pairs.is_empty() || self.parts.is_empty() {
            return None;
        }
        let joints = |capsule: &Capsule| [capsule.start.joint, capsule.end.joint];
        let of_source = pairs.iter().map(|hand| &hand.source).chain(self.parts.iter().map(|part| &part.source));
        let of_target = pairs.iter().map(|hand| &hand.target).chain(self.parts.iter().map(|part| &part.target));
        let source = stack.source_posing(of_source.flat_map(joints));
        let arms = pairs.iter().flat_map(|hand| stack.limb(hand.limb).target.joints());
        let target = stack.target_posing(of_target.flat_map(joints).chain(arms));
        let hand = |hand: &&HandPair| Hand {
            limb: hand.limb,
            arm: stack.moved_arm(stack.limb(hand.limb), true, &target),
            source: Fixed::new(&hand.source, &source),
            target: Fixed::new(&hand.target, &target),
        };
        let own = |arm: Option<Limb>| stack.mapping.limbs.iter().position(|pair| Some(pair.limb) == arm);
        let part = |part: &BodyPart| Part {
            own: own(part.arm),
            source: Fixed::new(&part.source, &source),
            target: Fixed::new(&part.target, &target),
        };
        let (source_leg, target_leg) = stack.legs();
        Some(SelfContactStage {
            op: self.op.clone(),
            schedule: op.schedule.clone(),
            hands: pairs.iter().map(hand).collect(),
            parts: self.parts.iter().map(part).collect(),
            source_leg,
            target_leg,
            source,
            target,
        })
    }
}

impl OpSpec for SelfContactOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let Context { source, target, .. } = *context;
        let unit = source.unit_meters / target.unit_meters;
        let hands = find_hands(context.limbs, source, target, unit);
        let resolved = ResolvedSelfContact { op: self.clone(), parts: body_parts(source, target, unit), hands };
        context.push_on_limbs(&self.scope, Limbs::Arms, resolved);
    }
}

fn find_hands(limbs: &[LimbPair], source: &Rig<'_>, target: &Rig<'_>, unit: f64) -> Vec<HandPair> {
    let pair = |(limb, pair): (usize, &LimbPair)| {
        Some(HandPair { limb, source: hand(source, pair.limb, unit)?, target: hand(target, pair.limb, 1.0)? })
    };
    limbs.iter().enumerate().filter_map(pair).collect()
}
