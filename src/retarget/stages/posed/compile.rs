//! From edits of a mapping to steps.

use glam::{DMat3, DQuat, DVec3};

use crate::{
    model::{Skeleton, Transform},
    retarget::{
        mapping::{TwistAgainst, TwistPair},
        ops::{
            JointSpace, PinMode, PinSide,
            edits::{
                ChainShape, ChainStretch, CopyDrive, DriveFrom, JointDrive, JointLimit, PinDrive, PosedEdit, PropDrive,
                ReachDrive,
            },
            schedule::Schedule,
        },
        spec::{RotationMode, TranslationMode},
    },
};

use super::{
    super::{compile::Compiler, limbs::LimbSlots, posing::Posing, work::Changed},
    CopyStep, PosedStage, Step,
    fades::{FadeStep, FadedJoint},
};
use crate::retarget::ops::{
    arm_spacing::ArmStep,
    fingers::{FingerAxes, FingerStep},
    fk::{
        poles::PoleStep,
        shapes::{Bone, Link, ShapeStep},
    },
    joints::{Follows, JointStep, Mapped, PositionStep},
    limits::LimitStep,
    pin::PinStep,
    props::carried::CarriedStep,
    reach::{GoalPlace, MOST_GOALS, ReachStep, ReachedGoal, TurnedJoint},
    stretch_chain::StretchStep,
    twist::{Against, TwistStep},
};

impl PosedStage {
    /// The stage of a list of edits; nothing where there are none.
    pub(in crate::retarget) fn of_edits(
        compiler: &Compiler<'_>,
        edits: &[PosedEdit],
        schedule: &Schedule,
    ) -> Option<Self> {
        Self::new(compiler, schedule, edits.len(), false, |builder| {
            edits.iter().map(|edit| builder.step(edit)).collect()
        })
    }

    /// The stage of the twist joints of some segments.
    pub(in crate::retarget) fn of_twists(
        compiler: &Compiler<'_>,
        gain: f64,
        masked: &[usize],
        schedule: &Schedule,
    ) -> Option<Self> {
        // A joint that is its own segment is turned by the source's motion alone.
        let is_wanted = |pair: &&TwistPair| {
            pair.segment != pair.joint && (masked.contains(&pair.segment) || masked.contains(&pair.joint))
        };
        let mut pairs: Vec<TwistPair> = compiler.mapping.twists.iter().filter(is_wanted).copied().collect();
        pairs.sort_by_key(|pair| pair.joint);
        Self::new(compiler, schedule, pairs.len(), false, |builder| {
            pairs.iter().map(|pair| builder.twist(pair, gain)).collect()
        })
    }

    /// The stage that fades what forward kinematics gave some joints.
    pub(in crate::retarget) fn of_fade(compiler: &Compiler<'_>, joints: &[usize], schedule: &Schedule) -> Option<Self> {
        Self::new(compiler, schedule, joints.len(), true, |builder| vec![Step::Fade(builder.fade(joints))])
    }

    /// Builds twice: to find out which joints are needed, and then with their slots.
    fn new(
        compiler: &Compiler<'_>,
        schedule: &Schedule,
        count: usize,
        fades: bool,
        build: impl Fn(&mut Builder<'_>) -> Vec<Step>,
    ) -> Option<Self> {
        if count == 0 {
            return None;
        }
        let mut first = Builder::new(compiler, None);
        build(&mut first);
        let source = compiler.source_posing(first.source_wanted);
        let target = compiler.target_posing(first.target_wanted);
        let mut builder = Builder::new(compiler, Some((&source, &target)));
        let steps = build(&mut builder);
        let changed = builder.changed;
        let slots = changed.iter().map(|changed| target.slot(changed.joint)).collect();
        Some(Self { schedule: schedule.clone(), source, target, steps, fades, changed, slots })
    }
}

/// How far along a chain each joint is, from 0 to 1; evenly spread where the chain has no length.
fn shares(lengths: &[f64]) -> Vec<f64> {
    let total: f64 = lengths.iter().sum();
    let mut so_far = 0.0;
    let after = lengths.iter().map(|length| {
        so_far += if total > 0.0 { length / total } else { 1.0 / lengths.len() as f64 };
        so_far
    });
    std::iter::once(0.0).chain(after).collect()
}

struct Builder<'a> {
    compiler: &'a Compiler<'a>,
    posings: Option<(&'a Posing, &'a Posing)>,
    source_wanted: Vec<usize>,
    target_wanted: Vec<usize>,
    changed: Vec<Changed>,
}

impl<'a> Builder<'a> {
    fn new(compiler: &'a Compiler<'a>, posings: Option<(&'a Posing, &'a Posing)>) -> Self {
        Self { compiler, posings, source_wanted: Vec::new(), target_wanted: Vec::new(), changed: Vec::new() }
    }

    fn source(&mut self, joint: usize) -> usize {
        self.source_wanted.push(joint);
        self.posings.map_or(0, |(source, _)| source.slot(joint))
    }

    fn target(&mut self, joint: usize) -> usize {
        self.target_wanted.push(joint);
        self.posings.map_or(0, |(_, target)| target.slot(joint))
    }

    fn change(&mut self, joint: usize, rotates: bool, moves: bool) -> usize {
        match self.changed.iter_mut().find(|changed| changed.joint == joint) {
            Some(changed) => {
                changed.rotates |= rotates;
                changed.moves |= moves;
            }
            None => self.changed.push(Changed { joint, rotates, moves }),
        }
        self.target(joint)
    }

    fn step(&mut self, edit: &PosedEdit) -> Step {
        match edit {
            PosedEdit::Joint(drive) => Step::Joint(Box::new(self.joint(drive))),
            PosedEdit::Pin(pin) => Step::Pin(Box::new(self.pin(pin))),
            PosedEdit::Copy(copy) => Step::Copy(self.copy(copy)),
            PosedEdit::Add { joint, turn } => Step::Add { slot: self.change(*joint, true, false), turn: *turn },
            PosedEdit::ArmSpacing { joint, chest, radians } => {
                let front = self.compiler.target_rest[*chest].rotation.conjugate() * self.compiler.ground().front;
                let slot = self.change(*joint, true, false);
                Step::Arm(ArmStep { slot, chest: self.target(*chest), front, radians: *radians })
            }
            PosedEdit::Stretch(stretch) => Step::Stretch(self.stretch(stretch)),
            PosedEdit::Limit(limit) => Step::Limit(Box::new(self.limit(limit))),
            PosedEdit::Finger(finger) => Step::Finger(FingerStep {
                slot: self.change(finger.joint, true, false),
                rest: self.rest_below_parent(finger.joint).rotation,
                axes: finger.axes.map(|[along, flexion]| FingerAxes { along, flexion }),
                curl: finger.curl,
                spread: finger.spread,
                curl_offset: finger.curl_offset,
            }),
            PosedEdit::Prop(prop) => Step::Carried(self.prop(prop)),
            PosedEdit::Reach(reach) => Step::Reach(Box::new(self.reach(reach))),
            PosedEdit::Shape(shape) => Step::Shape(Box::new(self.shape(shape))),
            PosedEdit::Pole { limb, align, offset, keeps_offset } => {
                Step::Pole(self.pole(*limb, *align, *offset, *keeps_offset))
            }
        }
    }

    fn joint(&mut self, drive: &JointDrive) -> JointStep {
        let rest = self.compiler.target_rest[drive.joint];
        let rest_local = self.rest_below_parent(drive.joint);
        let slot = self.change(drive.joint, drive.rotation_gain.is_some(), drive.position_gain.is_some());
        let follows = match drive.from {
            DriveFrom::Joint(joint) => Follows::Joint {
                source: self.source(joint),
                rest: self.compiler.source_rest[joint],
                rest_local: self.compiler.mapping.source_rest.to_local(self.compiler.source).transforms()[joint],
            },
            DriveFrom::Pair { points: [first, second], end } => {
                let end = self.compiler.target_rest[end].translation;
                let bone = rest.rotation.conjugate() * (end - rest.translation);
                Follows::Pair { points: [self.source(first), self.source(second)], bone }
            }
        };
        let axes_from_space = match (drive.space, drive.from) {
            (JointSpace::Local, DriveFrom::Joint(_)) => DQuat::IDENTITY,
            _ => DQuat::from_mat3(&self.compiler.ground().axes()).conjugate(),
        };
        let change = Mapped { axes_from_space, order: drive.axis_order, offset: drive.axis_offset };
        JointStep {
            slot,
            space: drive.space,
            follows,
            rotation_gain: drive.rotation_gain,
            rotation_offset: drive.rotation_offset,
            change,
            rest,
            rest_local,
            position: drive.position_gain.map(|gain| self.position(drive, gain)),
        }
    }

    fn position(&self, drive: &JointDrive, gain: f64) -> PositionStep {
        let ground = self.compiler.ground();
        let metres = drive.position_offset * ground.units_per_metre;
        let (raised, source_raised) = self.floors();
        match (drive.from, drive.space) {
            (DriveFrom::Pair { .. }, _) => PositionStep {
                travel: ground.travel * gain,
                offset: ground.axes() * metres + ground.up * ground.target_floor,
                source_floor: ground.up * ground.source_floor,
            },
            (DriveFrom::Joint(_), JointSpace::Model) => PositionStep {
                travel: ground.travel * gain,
                offset: ground.axes() * metres + raised,
                source_floor: source_raised,
            },
            (DriveFrom::Joint(joint), JointSpace::Local) => {
                let scale = |rest: &[Transform], parent: Option<usize>, above: f64| {
                    parent.map_or(DVec3::splat(above), |parent| rest[parent].scale)
                };
                let compiler = self.compiler;
                let source = scale(
                    &compiler.source_rest,
                    compiler.source.parent(joint),
                    compiler.mapping.plan_from_source.scale.x,
                );
                let target = scale(&compiler.target_rest, compiler.target.parent(drive.joint), 1.0);
                let unit = Transform { scale: target, ..Transform::IDENTITY };
                let into_target = |vector: DVec3| unit.relative(&Transform::from_translation(vector)).translation;
                let factor = into_target(source * compiler.mapping.global_scale * gain);
                PositionStep {
                    travel: DMat3::from_diagonal(factor),
                    offset: into_target(metres),
                    source_floor: DVec3::ZERO,
                }
            }
        }
    }

    /// How much higher the floors of result and clip are than those of the rest poses.
    fn floors(&self) -> (DVec3, DVec3) {
        let ground = self.compiler.ground();
        let raised = ground.up * (ground.target_floor - ground.target_rest_floor);
        (raised, ground.up * (ground.source_floor - ground.source_rest_floor))
    }

    /// The rest pose that motion is put onto, below the parent.
    fn rest_below_parent(&self, joint: usize) -> Transform {
        let rest = &self.compiler.target_rest;
        let above = self.compiler.target.parent(joint).map_or(self.compiler.plan_from_target, |parent| rest[parent]);
        above.relative(&rest[joint])
    }

    fn pin(&mut self, pin: &PinDrive) -> PinStep {
        let compiler = self.compiler;
        let ground = compiler.ground();
        let left_behind = if pin.carries_children { Vec::new() } else { self.driven_below(pin.joint) };
        let slot = self.change(pin.joint, pin.rotation, pin.position);
        let (to, to_rest) = match pin.side {
            PinSide::Source => (self.source(pin.to), compiler.source_rest[pin.to]),
            PinSide::Target => (self.target(pin.to), compiler.target_rest[pin.to]),
        };
        let (raised, source_raised) = self.floors();
        let rest = match (pin.mode, pin.side) {
            // Joints that nothing drives keep the file's own pose, so that is where the offset is taken from.
            (PinMode::KeepOffset, PinSide::Target) => {
                let hold = compiler.mapping.target_hold.to_model(compiler.target);
                let model = |joint: usize| compiler.plan_from_target.then_child(&hold.transforms()[joint]);
                to_rest.then_child(&model(pin.to).relative(&model(pin.joint)))
            }
            _ => compiler.target_rest[pin.joint],
        };
        PinStep {
            slot,
            to,
            side: pin.side,
            mode: pin.mode,
            position: pin.position,
            rotation: pin.rotation,
            offset: pin.offset * ground.units_per_metre,
            rotation_offset: pin.rotation_offset,
            rest,
            to_rest,
            travel: ground.travel,
            raised: raised - ground.travel * source_raised,
            local_scale: compiler.mapping.plan_from_source.scale.x * compiler.mapping.global_scale,
            left_behind,
        }
    }

    /// The topmost driven joints below a joint, which then change too.
    fn driven_below(&mut self, joint: usize) -> Vec<usize> {
        let topmost = self.compiler.topmost_driven_below(Some(joint));
        topmost.into_iter().map(|joint| self.change(joint, true, true)).collect()
    }

    fn prop(&mut self, prop: &PropDrive) -> CarriedStep {
        let compiler = self.compiler;
        let turn = |source: usize, target: usize| {
            compiler.source_rest[source].rotation.conjugate() * compiler.target_rest[target].rotation
        };
        CarriedStep {
            slot: self.change(prop.joint, true, true),
            holder: self.target(prop.holder),
            source: self.source(prop.source),
            source_holder: self.source(prop.source_holder),
            holder_turn: turn(prop.source_holder, prop.holder),
            prop_turn: turn(prop.source, prop.joint),
            scale: prop.scale,
        }
    }

    fn reach(&mut self, reach: &ReachDrive) -> ReachStep {
        let compiler = self.compiler;
        let ground = compiler.ground();
        let axes = ground.axes();
        let length = |skeleton: &Skeleton, rest: &[Transform], start: usize, end: usize| {
            let path = skeleton.path(start, end).unwrap_or_default();
            let place = |joint: usize| rest[joint].translation;
            path.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum::<f64>()
        };
        let lengths: Vec<f64> =
            reach.ends.iter().map(|end| length(compiler.target, &compiler.target_rest, end.start, end.end)).collect();
        let mut goals = Vec::with_capacity(reach.ends.len());
        for (end, &own) in reach.ends.iter().zip(&lengths) {
            let offset = axes * end.offset * ground.units_per_metre;
            let source = self.source(end.source);
            let place = match end.source_start {
                None => GoalPlace::World {
                    source,
                    travel: ground.travel,
                    offset: offset + ground.up * ground.target_floor - ground.travel * ground.up * ground.source_floor,
                },
                Some(start) => {
                    let of_source = length(compiler.source, &compiler.source_rest, start, end.source);
                    GoalPlace::Chain {
                        source,
                        source_start: self.source(start),
                        start: self.target(end.start),
                        scale: if of_source > 0.0 { own / of_source } else { compiler.mapping.global_scale },
                        offset,
                    }
                }
            };
            let along = |weight: DVec3| axes * DMat3::from_diagonal(weight) * axes.transpose();
            let counts = end.weight.to_array().map(|weight| if weight > 0.0 { 1.0 } else { 0.0 });
            goals.push(ReachedGoal {
                end: self.target(end.end),
                place,
                weight: along(end.weight),
                mask: along(DVec3::from(counts)),
                length: own.max(f64::MIN_POSITIVE),
            });
        }
        let mean = (lengths.iter().sum::<f64>() / lengths.len().max(1) as f64).max(f64::MIN_POSITIVE);
        let joints = reach.joints.iter().zip(&reach.stiffness).map(|(&joint, stiffness)| {
            let mut turns_for = [false; MOST_GOALS];
            for (turns, end) in turns_for.iter_mut().zip(&reach.ends) {
                *turns = end.turning.contains(&joint);
            }
            TurnedJoint {
                slot: self.change(joint, true, false),
                mobility: (1.0 - stiffness) / (mean * mean),
                turns_for,
            }
        });
        let joints: Vec<TurnedJoint> = joints.collect();
        ReachStep {
            goals,
            joints,
            pelvis: reach.pelvis.map(|(pelvis, freedom)| (self.change(pelvis, false, true), freedom)),
            kept: reach.ends.iter().map(|end| self.change(end.end, true, false)).collect(),
            iterations: reach.iterations,
            damping: reach.damping * reach.damping,
        }
    }

    fn pole(&mut self, limb: usize, align: f64, offset: f64, keeps_offset: bool) -> PoleStep {
        let compiler = self.compiler;
        let pair = compiler.limb(limb);
        let mut source = |joint: usize| self.source(joint);
        let source = LimbSlots {
            start: source(pair.source.start),
            middle: source(pair.source.middle),
            end: source(pair.source.end),
        };
        let target = LimbSlots {
            start: self.change(pair.target.start, true, false),
            middle: self.target(pair.target.middle),
            end: self.change(pair.target.end, true, false),
        };
        let kept_angle = if keeps_offset { compiler.rest(limb).pole_angle } else { 0.0 };
        PoleStep { source, target, kept_angle, align, offset }
    }

    fn fade(&mut self, joints: &[usize]) -> FadeStep {
        let compiler = self.compiler;
        let mapping = compiler.mapping;
        let is_pelvis = |joint: usize| mapping.pelvis.is_some_and(|pelvis| pelvis.target == joint);
        let twisted = |joint: usize| mapping.twists.iter().any(|twist| twist.joint == joint && twist.segment != joint);
        let is_lifted = |joint: usize| mapping.shoulders.iter().any(|shoulder| shoulder.joint == joint);
        // What follows these joints fades with them.
        let twists = mapping.twists.iter().filter(|twist| joints.contains(&twist.segment)).map(|twist| twist.joint);
        let lifted = mapping.shoulders.iter().filter(|pair| joints.contains(&pair.upper_arm)).map(|pair| pair.joint);
        let mut all: Vec<usize> = joints.iter().copied().chain(twists).chain(lifted).collect();
        all.sort_unstable();
        all.dedup();
        let below: Vec<usize> = all
            .iter()
            .flat_map(|&joint| compiler.topmost_driven_below(Some(joint)))
            .filter(|joint| !all.contains(joint))
            .collect();
        let faded: Vec<FadedJoint> =
            all.iter()
                .map(|&joint| {
                    let rest = self.rest_below_parent(joint);
                    let hold = mapping.target_hold.transforms()[joint];
                    let moves = is_pelvis(joint)
                        || mapping.chains.iter().any(|chain| {
                            chain.target.contains(&joint) && chain.drive.translation != TranslationMode::None
                        });
                    FadedJoint {
                        slot: self.change(joint, true, moves),
                        rest: if is_pelvis(joint) { rest } else { Transform { rotation: rest.rotation, ..hold } },
                        in_model: !twisted(joint) && !is_lifted(joint),
                        moves,
                    }
                })
                .collect();
        let below: Vec<usize> = below.into_iter().map(|joint| self.change(joint, true, false)).collect();
        let slots = faded.iter().map(|joint| joint.slot).chain(below.iter().copied()).collect();
        FadeStep { joints: faded, slots, below }
    }

    fn shape(&mut self, shape: &ChainShape) -> ShapeStep {
        let compiler = self.compiler;
        let source_joints: Vec<usize> = shape.source.iter().copied().chain(shape.ends.map(|ends| ends.0)).collect();
        let target_joints: Vec<usize> = shape.target.iter().copied().chain(shape.ends.map(|ends| ends.1)).collect();
        let lengths = |joints: &[usize], rest: &[Transform]| -> Vec<f64> {
            joints.windows(2).map(|pair| rest[pair[0]].translation.distance(rest[pair[1]].translation)).collect()
        };
        let source_lengths = lengths(&source_joints, &compiler.source_rest);
        let target_lengths = lengths(&target_joints, &compiler.target_rest);
        let (source_length, target_length) = (source_lengths.iter().sum::<f64>(), target_lengths.iter().sum::<f64>());
        let line_scale = match shape.rotation {
            RotationMode::MatchScaledChain if source_length > 0.0 => target_length / source_length,
            _ => compiler.mapping.global_scale,
        };
        let (source_shares, target_shares) = (shares(&source_lengths), shares(&target_lengths));
        let is_one_to_one = source_joints.len() == target_joints.len();
        let place = |share: f64, position: usize| {
            if is_one_to_one {
                return (position, 0.0);
            }
            let segment = source_shares.iter().rposition(|start| *start <= share).unwrap_or(0);
            let segment = segment.min(source_shares.len().saturating_sub(2));
            let length = source_shares.get(segment + 1).map_or(0.0, |end| end - source_shares[segment]);
            (segment, if length > 0.0 { ((share - source_shares[segment]) / length).clamp(0.0, 1.0) } else { 0.0 })
        };
        let source: Vec<usize> = source_joints.iter().map(|&joint| self.source(joint)).collect();
        let turns = shape.rotation != RotationMode::None;
        let moves = shape.translation != TranslationMode::None;
        let mut links = Vec::with_capacity(target_joints.len());
        for (position, &joint) in target_joints.iter().enumerate() {
            let is_end = position >= shape.target.len();
            let (segment, share) = place(target_shares[position], position);
            let bone = (position > 0 && source_joints.len() > 1).then(|| {
                let middle = f64::midpoint(target_shares[position - 1], target_shares[position]);
                let (segment, _) = place(middle, position - 1);
                let [from, to] = [segment, segment + 1].map(|index| compiler.source_rest[source_joints[index]]);
                let parent = compiler
                    .target
                    .parent(joint)
                    .map_or(compiler.plan_from_target, |parent| compiler.target_rest[parent]);
                Bone {
                    segment,
                    source_rest: from.rotation.conjugate() * (to.translation - from.translation),
                    target_from_source: parent.rotation.conjugate() * from.rotation,
                }
            });
            let slot = self.change(joint, turns && !is_end, moves && bone.is_some());
            let rest = self.rest_below_parent(joint);
            links.push(Link {
                slot,
                turns: turns && !is_end,
                rest_local: Transform { rotation: rest.rotation, ..compiler.mapping.target_hold.transforms()[joint] },
                follows: (source[segment], source[(segment + 1).min(source.len() - 1)], share),
                bone,
            });
        }
        let below: Vec<usize> = if turns {
            let topmost = shape.target.iter().flat_map(|&joint| compiler.topmost_driven_below(Some(joint)));
            topmost.filter(|joint| !shape.target.contains(joint)).collect()
        } else {
            Vec::new()
        };
        let below: Vec<usize> = below.into_iter().map(|joint| self.change(joint, true, false)).collect();
        ShapeStep {
            rotation: shape.rotation,
            translation: shape.translation,
            rotation_alpha: shape.rotation_alpha,
            translation_alpha: shape.translation_alpha,
            source,
            source_lengths,
            line_scale,
            end: shape.ends.map(|ends| self.target(ends.1)),
            kept: links.iter().map(|link| link.slot).chain(below.iter().copied()).collect(),
            links,
            below,
        }
    }

    fn copy(&mut self, copy: &CopyDrive) -> CopyStep {
        CopyStep {
            source: self.source(copy.source),
            slot: self.change(copy.joint, copy.rotation, copy.position),
            position: copy.position.then_some(self.compiler.mapping.plan_from_source.scale.x),
            rotation: copy.rotation,
        }
    }

    fn stretch(&mut self, stretch: &ChainStretch) -> StretchStep {
        let compiler = self.compiler;
        let (first, last) = (stretch.target[0], stretch.target[stretch.target.len() - 1]);
        // Joints of a chain may hang one below the other with others between, or not at all.
        let on_the_way = compiler.target.path(first, last).unwrap_or_else(|| stretch.target.clone());
        let place = |joint: usize| compiler.target_rest[joint].translation;
        let rest_length = on_the_way.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum();
        StretchStep {
            source: stretch.source.iter().map(|&joint| self.source(joint)).collect(),
            moved: on_the_way[1..].iter().map(|&joint| self.change(joint, false, true)).collect(),
            source_scale: compiler.mapping.global_scale,
            rest_length,
            match_source: stretch.match_source,
            scale: stretch.scale,
        }
    }

    fn limit(&mut self, limit: &JointLimit) -> LimitStep {
        LimitStep {
            slot: self.change(limit.joint, true, false),
            source: limit.source.map(|joint| self.source(joint)),
            zero: limit.zero,
            source_zero: limit.source_zero,
            axes: limit.axes,
            bend: limit.bend,
            side: limit.side,
            twist: limit.twist,
            begin: limit.begin,
        }
    }

    fn twist(&mut self, pair: &TwistPair, gain: f64) -> Step {
        let against = match pair.against {
            TwistAgainst::Carrier { joint, carrier_from_segment } => {
                Against::Carrier { slot: self.target(joint), carrier_from_segment }
            }
            TwistAgainst::End { joint, segment_from_end } => {
                Against::End { slot: self.target(joint), segment_from_end }
            }
        };
        let left_behind = self.driven_below(pair.joint);
        Step::Twist(TwistStep {
            slot: self.change(pair.joint, true, false),
            segment: self.target(pair.segment),
            against,
            axis: pair.axis,
            segment_from_joint: pair.segment_from_joint,
            share: pair.share * gain,
            left_behind,
        })
    }
}
