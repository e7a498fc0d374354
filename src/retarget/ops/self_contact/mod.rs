//! Hands that touch the body touch it on the target as well. (docs/algorithm/body.md.)
//!
//! For every frame the place of each hand about each part of the body is read from the source: how far along the part, on which
//! side, how far from its surface. That place on the target is what the hand is led to, the more the nearer the source's is. What hands
//! are moved by is smoothed over time, and what the smoothing took off is added again, as smoothly, in a fixed number of rounds: the
//! result depends on neither the number of threads nor where the work stopped. The little by which a hand is still in the body then
//! is taken out as it is.

pub(in crate::retarget) mod spec;

pub use self::spec::SelfContactOp;

use crate::retarget::stages::stage::Stage;
use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::{Context, Limbs},
        op_spec::OpSpec,
        resolved::{OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};
use crate::{
    retarget::mapping::LimbPair,
    rig::{
        BodyPart, HandPair, Limb,
        rig::Rig,
        volumes::{body_parts, hand},
    },
};
use glam::DVec3;

use crate::model::rotation::smootherstep;
use rayon::prelude::*;

use super::schedule::Schedule;
use crate::{model::Canceled, rig::Capsule};

use crate::retarget::stages::{
    gaps::{Fixed, Gap, Line, between},
    posing::{Pose, Posing},
    temporal::smoothed,
    work::Work,
};

/// How often hands are led to what they touch, and arms solved.
const SELF_CONTACT_PASSES: usize = 8;
/// How often they are brought out of the body after that: what one hand does moves the arm that the other one lies on.
const SETTLING_PASSES: usize = 2;
/// Rounds of leading hands to where they should be and smoothing that.
const ROUNDS: usize = 2;
/// Rounds of pushing a hand out of all parts, one after the other.
const PUSHES: usize = 3;
/// The arms of a body.
const MAX_HANDS: usize = 2;

/// Leads hands.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct SelfContactStage {
    pub(in crate::retarget) op: SelfContactOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) hands: Vec<Hand>,
    pub(in crate::retarget) parts: Vec<Part>,
    pub(in crate::retarget) source: Posing,
    pub(in crate::retarget) target: Posing,
    /// Length of the source's leg in plan units, and the target's over it.
    pub(in crate::retarget) source_leg: f64,
    pub(in crate::retarget) leg_ratio: f64,
    pub(in crate::retarget) limb_count: usize,
    /// Whether hands have been led already, and are only to be brought out of the body, frame by frame.
    pub(in crate::retarget) settles: bool,
}

/// A hand of both sides; a ball.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Hand {
    pub(in crate::retarget) limb: usize,
    pub(in crate::retarget) source: Fixed,
    pub(in crate::retarget) target: Fixed,
}

/// A part of the body of both sides.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Part {
    /// The limb that it is a part of; its own hand does not look at it.
    pub(in crate::retarget) own: Option<usize>,
    pub(in crate::retarget) source: Fixed,
    pub(in crate::retarget) target: Fixed,
}

/// What hands are to be moved by at a frame.
type Moves = [DVec3; MAX_HANDS];

impl SelfContactStage {
    /// What is still missing when hands have been moved already.
    fn wanted(&self, source: &Pose, target: &Pose, work: &Work<'_>, frame: usize, already: &Moves) -> Moves {
        let mut of_source = [Line::default(); MAX_HANDS];
        let mut of_target = [Line::default(); MAX_HANDS];
        for (index, hand) in self.hands.iter().enumerate() {
            let goal = &work.goals[frame * self.limb_count + hand.limb];
            of_source[index] = hand.source.line(source);
            let palm = goal.position + goal.rotation * hand.target.start.1 + already[index];
            of_target[index] = Line { start: palm, end: palm, radius: hand.target.radius };
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
            if self.op.keep_touch && !self.settles {
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
        gap.distance * (target_radius / source_radius * near + self.leg_ratio * (1.0 - near))
    }
}

impl Stage for SelfContactStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let count = work.frame_count();
        let mut moves = vec![[DVec3::ZERO; MAX_HANDS]; count];
        let (rounds, smoothing_seconds) = if self.settles { (1, 0.0) } else { (ROUNDS, self.op.smoothing_seconds) };
        for _ in 0..rounds {
            let fill = |(source, target): &mut (Pose, Pose), frame: usize, row: &mut [Moves]| {
                self.source.fill(source, work.source, frame);
                self.target.fill(target, &work.target, frame);
                row[0] = self.wanted(source, target, work, frame, &moves[frame]);
            };
            let wanted = work.rows(1, || (self.source.pose(), self.target.pose()), fill)?;
            if wanted.iter().all(|wanted| *wanted == [DVec3::ZERO; MAX_HANDS]) {
                break;
            }
            let smooth = |hand: usize| {
                let more: Vec<DVec3> = wanted.iter().map(|wanted| wanted[hand]).collect();
                smoothed(&more, work.performed, smoothing_seconds)
            };
            let more: Vec<Vec<DVec3>> = (0..self.hands.len()).into_par_iter().map(smooth).collect();
            for (hand, more) in more.iter().enumerate() {
                moves.iter_mut().zip(more).for_each(|(moves, more)| moves[hand] += *more);
            }
        }
        work.change_goals(self.limb_count, |work, frame, goals| {
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (hand, moved) in self.hands.iter().zip(&moves[frame]) {
                goals[hand.limb].position += *moved * alpha;
            }
        })
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
        // Arms are a part of the body, too: what they touch has moved once they have reached their goals.
        for pass in 0..SELF_CONTACT_PASSES + SETTLING_PASSES {
            stack.close();
            stack.need_goals(&op.limbs);
            if let Some(stage) = self.stage(op, stack, pass >= SELF_CONTACT_PASSES) {
                stack.push(stage);
            }
        }
        stack.close();
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        op.limb_joints(mapping, false)
    }
}

impl ResolvedSelfContact {
    /// Nothing where there is no hand, or nothing that it could touch.
    fn stage(&self, op: &ResolvedOp, stack: &StackBuilder<'_>, settles: bool) -> Option<SelfContactStage> {
        let pairs: Vec<&HandPair> = self.hands.iter().filter(|hand| op.limbs.contains(&hand.limb)).collect();
        if pairs.is_empty() || self.parts.is_empty() {
            return None;
        }
        let joints = |capsule: &Capsule| [capsule.start.joint, capsule.end.joint];
        let of_source = pairs.iter().map(|hand| &hand.source).chain(self.parts.iter().map(|part| &part.source));
        let of_target = pairs.iter().map(|hand| &hand.target).chain(self.parts.iter().map(|part| &part.target));
        let source = stack.source_posing(of_source.flat_map(joints));
        let target = stack.target_posing(of_target.flat_map(joints));
        let hand = |hand: &&HandPair| Hand {
            limb: hand.limb,
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
            leg_ratio: target_leg / source_leg,
            limb_count: stack.limb_count(),
            settles,
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
