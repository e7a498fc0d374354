//! What a `floor` op becomes: feet that stand on the floor, toes that bend, tails that rise.

use std::sync::Arc;

use glam::DVec3;

use super::{
    FloorFoot, FloorHand, FloorOp, FloorStage, FootSlots, HandStage, Sole, Surface, TiltStage, Trunks,
    tails::{LiftedTail, TailStage},
    toes::{ToeStage, ToedFoot},
};
use crate::{
    model::{Reporter, Skeleton, Transform},
    retarget::{
        mapping::{LimbPair, Mapping},
        ops::{
            context::{Context, Limbs},
            feet::{ALIKE, size_ratio},
            op_spec::OpSpec,
            resolved::{Ahead, OpWork, ResolvedOp},
            scope::Scope,
        },
        stages::{builder::StackBuilder, posing::Posing, stage::Stage, work::Changed},
    },
    rig::{
        Anchor, Limb, LimbJoints, Tail,
        hands::{Wrist, arm_joints, hand_ends},
        tails::find_tails,
        trunk_ends,
    },
};

/// A `floor` op, and the tails that it keeps above the floor.
#[derive(Clone, Debug)]
struct ResolvedFloor {
    op: FloorOp,
    tails: Vec<Tail>,
    /// Where the trunks of source and target end, and how much beyond, in plan units.
    trunks: [Ends; 2],
    hands: Vec<Hand>,
}

/// Where a part of the body ends, and how much beyond.
type Ends = Vec<(Anchor, f64)>;

/// An arm of both sides with its hands.
#[derive(Clone, Debug)]
struct Hand {
    arm: LimbPair,
    /// Whether the target's hand turns about its wrist, and not with the forearm alone.
    turns: bool,
    /// Of source and target, in plan units.
    ends: [Ends; 2],
}

impl Hand {
    /// The joints of the target that turn.
    fn turned(&self) -> impl Iterator<Item = usize> + use<> {
        let count = if self.turns { 3 } else { 2 };
        self.arm.target.joints().into_iter().take(count)
    }
}

impl OpWork for ResolvedFloor {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.need_goals(&op.limbs);
        self.tilt(op, stack);
        stack.is_tilted = false;
        let stage = floor_stage(stack, self, op);
        let toes = toe_stage(stack, op).map(|stage| Arc::new(stage) as Arc<dyn Stage>);
        let tails = tail_stage(stack, self, op).map(|stage| Arc::new(stage) as Arc<dyn Stage>);
        let hands = hand_stage(stack, self, op, &stage.feet).map(|stage| Arc::new(stage) as Arc<dyn Stage>);
        stack.after_solve = toes.into_iter().chain(tails).chain(hands).collect();
        stack.push(stage);
        stack.moves_feet = true;
        if self.op.shift_pelvis && stack.pull.is_none() {
            stack.pull = Some((false, 1.0));
        }
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        let tails = self.tails.iter().flat_map(|tail| &tail.joints).map(|tail| tail.joint);
        let tails = tails.filter(|_| self.op.scope.mask.is_none());
        let pelvis = op.shifted(mapping, self.op.shift_pelvis);
        let hands = self.hands.iter().flat_map(Hand::turned);
        pelvis.into_iter().chain(op.limb_joints(mapping, true)).chain(tails).chain(hands).collect()
    }

    fn prepare_feet(&self, op: &ResolvedOp, stack: &mut StackBuilder<'_>) -> Ahead {
        self.tilt(op, stack);
        Ahead::Prepared
    }

    /// Tells that feet are set flat because the source does not say how they are turned.
    fn report(&self, op: &ResolvedOp, before: &[ResolvedOp], limbs: &[LimbPair], reporter: &mut Reporter) {
        let sets_flat = |op: &ResolvedOp| op.limbs.iter().any(|limb| limbs[*limb].has_stiff_foot);
        let is_told = before.iter().any(|op| op.name() == "floor" && sets_flat(op));
        if sets_flat(op) && !is_told {
            reporter.warn(
                "feet_set_flat",
                "source",
                "the source has no toes and its feet never turn against the shins, so that nothing says how they are turned; \
                 feet are set flat while they stand",
                "send a source whose feet are animated, or leave the floor op out",
            );
        }
    }
}

impl ResolvedFloor {
    /// Tilts feet before anything holds them, once.
    fn tilt(&self, op: &ResolvedOp, stack: &mut StackBuilder<'_>) {
        if !stack.is_tilted {
            stack.need_goals(&op.limbs);
            let stage = floor_stage(stack, self, op);
            stack.push(TiltStage(stage));
            stack.is_tilted = true;
        }
    }
}

impl OpSpec for FloorOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let tails = find_tails(context.target);
        let unit = context.source.unit_meters / context.target.unit_meters;
        let trunks = [in_plan_units(trunk_ends(context.source), unit), trunk_ends(context.target)];
        let hands = find_hands(self, context, unit);
        context.push_on_limbs(&self.scope, Limbs::Legs, ResolvedFloor { op: self.clone(), tails, trunks, hands });
    }
}

/// Ends of a side in its own unit, of which one is so many plan units.
fn in_plan_units(ends: Ends, unit: f64) -> Ends {
    ends.into_iter().map(|(anchor, radius)| (anchor.in_unit(unit), radius * unit)).collect()
}

/// The hands that the op keeps above the floor: those of all arms, unless it is about some limbs only.
fn find_hands(op: &FloorOp, context: &Context<'_>, unit: f64) -> Vec<Hand> {
    if !op.hands || op.scope.mask.is_some() {
        return Vec::new();
    }
    let Context { source, target, .. } = *context;
    let hand = |limb: Limb| {
        let (source_arm, target_arm) = (arm_joints(source, limb, unit)?, arm_joints(target, limb, 1.0)?);
        let arm = LimbPair::of(limb, source_arm, target_arm);
        let ends = [in_plan_units(hand_ends(source, limb), unit), hand_ends(target, limb)];
        Some(Hand { arm, turns: Wrist::of(target, limb)?.turns_hand, ends })
    };
    let hands = [Limb::LeftArm, Limb::RightArm].into_iter().filter_map(hand);
    hands.filter(|hand| hand.ends.iter().all(|ends| !ends.is_empty())).collect()
}

/// The axis about which the target's toes bend up where the floor is, in the axes of their joint: feet that are the source's
/// have its toes. Nothing where toes have no length or stand upright at rest.
fn toes_of(stack: &StackBuilder<'_>, limb: usize) -> Option<DVec3> {
    let pair = stack.limb(limb);
    let (source, target) = (pair.source.sole?, pair.target.sole?);
    pair.target.ball?;
    if size_ratio(stack, limb, &source, &target).is_some() {
        return None;
    }
    let toes = pair.target_foot.points.iter().filter(|point| point.gives_way).map(|point| point.from_ball);
    let toes: DVec3 = toes.sum();
    toes.cross(-target.down[1]?).try_normalize()
}

fn toe_stage(stack: &StackBuilder<'_>, resolved: &ResolvedOp) -> Option<ToeStage> {
    let toes = |&limb: &usize| toes_of(stack, limb).map(|raise| (limb, raise));
    let toes: Vec<(usize, DVec3)> = resolved.limbs.iter().filter_map(toes).collect();
    let ends = toes.iter().flat_map(|(limb, _)| foot_joints(stack, *limb, true));
    let target = stack.target_posing(ends);
    let foot = |&(limb, raise): &(usize, DVec3)| {
        let joints = stack.limb(limb).target;
        let slots = foot_slots(&joints, &target);
        let shape = &stack.limb(limb).target_foot;
        let yielding = shape.points.iter().filter(|point| point.gives_way).copied().collect();
        Some(ToedFoot { ball: joints.ball?, slots, sole: Sole::new(shape, true), yielding, raise })
    };
    let feet: Vec<ToedFoot> = toes.iter().filter_map(foot).collect();
    let (schedule, ground, (_, leg)) = (resolved.schedule.clone(), stack.ground(), stack.legs());
    (!feet.is_empty()).then_some(ToeStage { schedule, feet, target, ground, leg })
}

/// Shin, ankle and joint of the ball of one side.
fn foot_joints(stack: &StackBuilder<'_>, limb: usize, of_target: bool) -> impl Iterator<Item = usize> + use<> {
    let pair = stack.limb(limb);
    let joints = if of_target { pair.target } else { pair.source };
    [Some(joints.shin), Some(joints.end), joints.ball].into_iter().flatten()
}

fn floor_stage(stack: &StackBuilder<'_>, floor: &ResolvedFloor, resolved: &ResolvedOp) -> FloorStage {
    let op = &floor.op;
    let source = stack.source_posing(resolved.limbs.iter().flat_map(|&limb| foot_joints(stack, limb, false)));
    let leg = |limb: usize| stack.limb(limb).target.joints();
    let target = resolved.limbs.iter().flat_map(|&limb| foot_joints(stack, limb, true).chain(leg(limb)));
    let target = stack.target_posing(target);
    let up = |limb: usize| {
        let rest = stack.target_rest[stack.limb(limb).target.end].rotation;
        rest.conjugate() * stack.ground().up
    };
    let foot = |&limb: &usize| {
        let pair = stack.limb(limb);
        let (source_sole, target_sole) = (pair.source.sole?, pair.target.sole?);
        let ratio = size_ratio(stack, limb, &source_sole, &target_sole);
        let leg_ratio = stack.rest(limb).length_ratio;
        Some(FloorFoot {
            limb,
            source: foot_slots(&pair.source, &source),
            source_sole: Sole::new(&pair.source_foot, pair.source.ball.is_some()),
            target: foot_slots(&pair.target, &target),
            target_sole: Sole::new(&pair.target_foot, pair.target.ball.is_some()),
            leg: leg(limb).map(|joint| target.slot(joint)),
            toes_give_way: toes_of(stack, limb).is_some(),
            is_same: ratio.is_some_and(|ratio| (ratio - leg_ratio).abs() <= ALIKE * leg_ratio),
            stands: target_sole.down[0].map(|down| -down),
            depth: target_sole.down[0].map(|down| pair.target_foot.depth(down)),
            toes_up: target_sole.down[1].map(|down| -down),
            flat: pair.has_stiff_foot.then(|| up(limb)),
        })
    };
    let (source_leg, target_leg) = stack.legs();
    FloorStage {
        op: op.clone(),
        schedule: resolved.schedule.clone(),
        feet: resolved.limbs.iter().filter_map(foot).collect(),
        ground: stack.ground(),
        source_leg,
        target_leg,
        limb_count: stack.limb_count(),
        trunks: trunks(stack, floor),
        goal_limbs: stack.open.iter().map(|(limb, _)| *limb).collect(),
        source,
        target,
    }
}

/// Nothing where the op leaves the pelvis alone, or a side has no trunk.
fn trunks(stack: &StackBuilder<'_>, floor: &ResolvedFloor) -> Option<Trunks> {
    let pelvis = stack.mapping.pelvis.filter(|_| floor.op.shift_pelvis && floor.op.trunk)?;
    let [source, target] = &floor.trunks;
    if source.is_empty() || target.is_empty() {
        return None;
    }
    let source = Surface::new(source, |joints| stack.source_posing(joints.iter().copied()));
    let (ground, posing) = (stack.ground(), stack.source_posing([pelvis.source]));
    let slot = posing.slot(pelvis.source);
    Some(Trunks {
        pelvis: (posing, slot),
        upright: stack.source_rest[pelvis.source].translation.dot(ground.up) - ground.source_rest_floor,
        standing: source.lowest_of(&stack.source_rest, ground.up) - ground.source_rest_floor,
        target: Surface::new(target, |joints| stack.target_posing(joints.iter().copied())),
        source,
    })
}

/// Nothing where there is no tail, and where the op is about some limbs only.
fn tail_stage(stack: &StackBuilder<'_>, floor: &ResolvedFloor, op: &ResolvedOp) -> Option<TailStage> {
    let tails = &floor.tails;
    let joints: Vec<usize> = tails.iter().flat_map(|tail| &tail.joints).map(|joint| joint.joint).collect();
    if joints.is_empty() || floor.op.scope.mask.is_some() {
        return None;
    }
    let posing = stack.target_posing(joints.iter().copied());
    let lifted = |tail: &Tail| LiftedTail {
        joints: tail.joints.iter().map(|joint| (posing.slot(joint.joint), joint.points.clone())).collect(),
        sunk: tail.sunk,
    };
    Some(TailStage {
        schedule: op.schedule.clone(),
        tails: tails.iter().map(lifted).collect(),
        ground: stack.ground(),
        changed: joints.iter().map(|&joint| Changed { joint, rotates: true, moves: false }).collect(),
        posing,
    })
}

/// Nothing where there is no hand. `feet` are those of the op.
fn hand_stage(
    stack: &StackBuilder<'_>,
    floor: &ResolvedFloor,
    op: &ResolvedOp,
    feet: &[FloorFoot],
) -> Option<HandStage> {
    if floor.hands.is_empty() {
        return None;
    }
    let starts: Vec<usize> = floor.hands.iter().map(|hand| hand.arm.target.start).collect();
    let carrier = carrier_of(stack.target, &starts);
    let carriers = stack.target_posing(carrier.map_or(starts, |carrier| vec![carrier]));
    let hands: Vec<FloorHand> = floor.hands.iter().map(|hand| floor_hand(stack, hand, (&carriers, carrier))).collect();
    let is_alike = |hand: &FloorHand| hand.source.is_guessed() == hand.target.is_guessed();
    let is_same = !feet.is_empty() && feet.iter().all(|foot| foot.is_same) && hands.iter().all(is_alike);
    let (source_leg, target_leg) = stack.legs();
    Some(HandStage {
        schedule: op.schedule.clone(),
        hands,
        carriers,
        ground: stack.ground(),
        source_leg,
        target_leg,
        is_same,
        riders: stack.riders(),
    })
}

/// The lowest joint that carries some joints; nothing where they hang apart.
fn carrier_of(skeleton: &Skeleton, joints: &[usize]) -> Option<usize> {
    let carries = |above: &usize| joints.iter().all(|joint| skeleton.is_ancestor_or_self(*above, *joint));
    std::iter::successors(joints.first().copied(), |joint| skeleton.parent(*joint)).find(carries)
}

/// `carrier` is what carries all arms, if something does, and a posing with that or where each arm begins.
fn floor_hand(stack: &StackBuilder<'_>, hand: &Hand, (carriers, carrier): (&Posing, Option<usize>)) -> FloorHand {
    let (arm, [source, target]) = (&hand.arm, &hand.ends);
    let source = Surface::new(source, |joints| stack.source_posing(joints.iter().copied().chain(arm.source.joints())));
    let target = Surface::new(target, |joints| stack.target_posing(joints.iter().copied().chain(arm.target.joints())));
    let carrier = carrier.unwrap_or(arm.target.start);
    let path = stack.target.path(carrier, arm.target.start).unwrap_or_default();
    let place = |joint: usize| stack.target_rest[joint].translation;
    let to_arm: f64 = path.windows(2).map(|bone| place(bone[0]).distance(place(bone[1]))).sum();
    let up = stack.ground().up;
    let reach = |rest: &[Transform], joints: &LimbJoints, surface: &Surface| {
        let [start, middle, end] = joints.joints().map(|joint| rest[joint].translation);
        start.distance(middle) + middle.distance(end) + surface.farthest_of(rest, end)
    };
    let of_source = reach(&stack.source_rest, &arm.source, &source);
    let height = stack.source_rest[arm.source.start].translation.dot(up) - stack.ground().source_rest_floor;
    FloorHand {
        arm: stack.moved_arm(arm, hand.turns, &target.posing),
        carrier: carriers.slot(carrier),
        reach: to_arm + reach(&stack.target_rest, &arm.target, &target),
        hangs: (height - of_source) / stack.legs().0,
        source,
        target,
    }
}

fn foot_slots(joints: &LimbJoints, posing: &Posing) -> FootSlots {
    let ball = joints.ball.map(|ball| posing.slot(ball));
    FootSlots { end: posing.slot(joints.end), ball, shin: posing.slot(joints.shin) }
}
