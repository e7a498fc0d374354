//! From a mapping to a plan.

use glam::{DMat3, DQuat, DVec3};

use super::{
    mapping::{ChainPair, Chord, Mapping, PelvisPair, ShoulderPair, TwistAgainst, TwistPair},
    ops::Carry,
    spec::TranslationMode,
};
use crate::{
    model::{Skeleton, Transform},
    rig::{
        Ride,
        anatomy::{by_joint, carried_order},
    },
};

use super::places::{Place, places};
use super::plan::{
    CarriedDriver, CarryStep, ChordStep, Driver, ModelDriver, Needs, Output, Parent, PelvisDriver, PelvisFurther, Plan,
    RideStep, Sample, ShoulderDriver, SourceStep, TargetStep, Translation, TwistDriver, TwistEnd, TwistSegment,
};

impl Plan {
    /// Compiles a mapping. The skeletons are those that the mapping's indices are about.
    #[must_use]
    pub fn new(source: &Skeleton, target: &Skeleton, mapping: &Mapping) -> Self {
        Compiler::new(source, target, mapping).compile()
    }
}

struct Compiler<'a> {
    source: &'a Skeleton,
    target: &'a Skeleton,
    mapping: &'a Mapping,
    /// Source rest in plan space.
    source_rest: Vec<Transform>,
    /// Target rest in plan space.
    target_rest: Vec<Transform>,
    /// Slot of each source joint that is accumulated.
    source_slots: Vec<Option<usize>>,
    source_steps: Vec<SourceStep>,
    /// What each target joint rides.
    rides: Vec<Option<Ride>>,
}

impl<'a> Compiler<'a> {
    fn new(source: &'a Skeleton, target: &'a Skeleton, mapping: &'a Mapping) -> Self {
        let below = |rest: &Transform| mapping.plan_from_source.then_child(rest);
        let plan_from_target = Transform::from_rotation(mapping.plan_from_target);
        Self {
            source,
            target,
            mapping,
            source_rest: mapping.source_rest.transforms().iter().map(below).collect(),
            target_rest: mapping
                .target_rest
                .transforms()
                .iter()
                .map(|rest| plan_from_target.then_child(rest))
                .collect(),
            source_slots: vec![None; source.len()],
            source_steps: Vec::new(),
            rides: by_joint(target.len(), &mapping.rides),
        }
    }

    fn compile(mut self) -> Plan {
        self.lay_out_source();
        let mut drivers: Vec<Driver> = vec![Driver::Hold; self.target.len()];
        let (mut carried_slots, mut chord_slots) = (0, 0);
        for chain in &self.mapping.chains {
            match chain.drive.carry {
                Carry::Model => self.compile_chain(chain, &mut drivers, &mut chord_slots),
                Carry::Parent => self.compile_carried_chain(chain, &mut drivers, &mut carried_slots),
            }
        }
        let twists = self.compile_twists(&drivers);
        let shoulders = self.compile_shoulders(&drivers);
        if let Some(pelvis) = &self.mapping.pelvis {
            drivers[pelvis.target] = Driver::Pelvis(self.compile_pelvis(pelvis));
        }
        let carries = carried_slots > 0;
        for (joint, twist) in twists {
            drivers[joint] = Driver::Twist(twist);
        }
        for (joint, shoulder) in shoulders {
            drivers[joint] = Driver::Shoulder(shoulder);
        }
        let needs = self.target_needs(&drivers, carries);
        let (target_steps, slots) = self.lay_out_target(drivers, &needs);
        let outputs = self.outputs(&target_steps, &slots, carries);
        Plan {
            source_steps: self.source_steps,
            target_steps,
            carried_slots,
            chord_slots,
            outputs,
            target_joint_count: self.target.len(),
            normalizes: !carries,
        }
    }

    /// Decides which source joints are accumulated, and of which the position is needed too.
    fn lay_out_source(&mut self) {
        let mut needs: Vec<Option<Needs>> = vec![None; self.source.len()];
        if let Some(pelvis) = &self.mapping.pelvis {
            self.need_with_ancestors(&mut needs, pelvis.source, Needs::Transform);
        }
        for chain in &self.mapping.chains {
            let wanted = match (chain.drive.carry, chain.drive.translation) {
                (Carry::Model, translation) if translation == TranslationMode::None || translation.is_shape() => {
                    Needs::Rotation
                }
                _ => Needs::Transform,
            };
            for &joint in chain.source.iter().chain(chain.also.iter().flat_map(|further| &further.source)) {
                self.need_with_ancestors(&mut needs, joint, wanted);
            }
            if let Some(chord) = &chain.chord {
                self.need_with_ancestors(&mut needs, chord.source_end, Needs::Transform);
            }
        }
        for (joint, wanted) in needs.into_iter().enumerate() {
            let Some(needs) = wanted else { continue };
            let parent = self.source_parent(joint);
            self.source_slots[joint] = Some(self.source_steps.len());
            let rest = self.source.joints()[joint].rest;
            self.source_steps.push(SourceStep { joint, parent, rest, needs });
        }
    }

    fn need_with_ancestors(&self, needs: &mut [Option<Needs>], joint: usize, wanted: Needs) {
        let mut current = Some(joint);
        while let Some(index) = current {
            if needs[index] == Some(Needs::Transform) || needs[index] == Some(wanted) {
                return;
            }
            needs[index] = Some(wanted);
            current = self.source.parent(index);
        }
    }

    /// What a source joint hangs below; ancestors are laid out before.
    fn source_parent(&self, joint: usize) -> Parent {
        match self.source.parent(joint).and_then(|parent| self.source_slots[parent]) {
            Some(slot) => Parent::Slot(slot),
            None => Parent::Constant(self.mapping.plan_from_source),
        }
    }

    fn slot(&self, joint: usize) -> usize {
        self.source_slots[joint].expect("every joint of a mapped chain was laid out")
    }

    fn compile_pelvis(&self, pair: &PelvisPair) -> PelvisDriver {
        let rest = self.target_rest[pair.target];
        let turn = DMat3::from_quat(pair.position.canonical_from_plan);
        let matrix = turn.transpose() * DMat3::from_diagonal(pair.position.scale) * turn;
        let mut rotation = self.source_rest[pair.source].rotation.conjugate() * rest.rotation;
        if pair.local_turn != DQuat::IDENTITY {
            rotation *= pair.local_turn;
        }
        let PelvisPair { turn, local_offset, crotch, .. } = *pair;
        let goes_further = turn != DQuat::IDENTITY || local_offset != DVec3::ZERO || crotch.is_some();
        PelvisDriver {
            source_slot: self.slot(pair.source),
            rotation,
            rotation_alpha: pair.rotation_alpha,
            matrix,
            offset: pair.position.target_origin - matrix * pair.position.source_origin,
            translation_alpha: pair.translation_alpha,
            rest_position: rest.translation,
            rest_scale: rest.scale,
            further: goes_further.then(|| Box::new(PelvisFurther { turn, local_offset, crotch })),
        }
    }

    fn compile_chain(&self, chain: &ChainPair, drivers: &mut [Driver], chord_slots: &mut usize) {
        let further: Vec<(ChainPair, Vec<Option<Place>>)> = chain
            .further()
            .into_iter()
            .map(|chain| {
                let places = places(&chain, &self.source_rest, &self.target_rest);
                (chain, places)
            })
            .collect();
        let places = places(chain, &self.source_rest, &self.target_rest);
        let mut begin = self.chord_step(chain, &places, *chord_slots).map(Box::new);
        let chord = begin.as_ref().map(|step| step.slot);
        let has_chest = chain.chord.is_some_and(|chord| chord.correction.has_chest());
        *chord_slots += chord.map_or(0, |_| 1 + usize::from(has_chest));
        for (position, (&joint, place)) in chain.target.iter().zip(places).enumerate() {
            let Some(place) = place else {
                drivers[joint] = Driver::Hold;
                continue;
            };
            let is_chest = has_chest && position + 1 == chain.target.len();
            let also = further.iter().filter_map(|(chain, places)| {
                let place = places[position]?;
                Some((self.model_sample(chain, place), self.model_rotation(chain, place, joint)))
            });
            drivers[joint] = Driver::Model(ModelDriver {
                sample: self.model_sample(chain, place),
                rotation: self.model_rotation(chain, place, joint),
                also: also.collect(),
                rotation_alpha: chain.drive.followed_rotation_alpha(),
                translation: self.translation(chain, place),
                chord: chord.map(|slot| slot + usize::from(is_chest)),
                begin: begin.take(),
            });
        }
    }

    /// The joints that share a twist. Those whose limb or whose end no source joint drives as it is have none to share.
    fn compile_twists(&self, drivers: &[Driver]) -> Vec<(usize, TwistDriver)> {
        let compile = |pair: &TwistPair| {
            let (sample, rotation) = as_driven(&drivers[pair.segment])?;
            let segment = if pair.segment == pair.joint {
                TwistSegment::Source(sample, rotation)
            } else {
                TwistSegment::Slot(pair.segment)
            };
            let against = match pair.against {
                TwistAgainst::Carrier { joint, carrier_from_segment } => TwistEnd::Carrier(joint, carrier_from_segment),
                TwistAgainst::End { joint, segment_from_end } => {
                    let (sample, rotation) = as_driven(&drivers[joint])?;
                    TwistEnd::End(sample, rotation, segment_from_end.conjugate())
                }
            };
            let TwistPair { joint, axis, segment_from_joint, share, .. } = *pair;
            Some((joint, TwistDriver { segment, against, axis, segment_from_joint, share }))
        };
        self.mapping.twists.iter().filter_map(compile).collect()
    }

    /// The clavicles that follow arms which the source drives as they are.
    fn compile_shoulders(&self, drivers: &[Driver]) -> Vec<(usize, ShoulderDriver)> {
        let compile = |pair: &ShoulderPair| {
            let (sample, rotation) = as_driven(&drivers[pair.upper_arm])?;
            let ShoulderPair { joint, arm, up, axis, free_radians, share, .. } = *pair;
            Some((joint, ShoulderDriver { sample, rotation, arm, up, axis, free_radians, share }))
        };
        self.mapping.shoulders.iter().filter_map(compile).collect()
    }

    fn compile_carried_chain(&self, chain: &ChainPair, drivers: &mut [Driver], carried_slots: &mut usize) {
        let places = places(chain, &self.source_rest, &self.target_rest);
        let first_slot = *carried_slots;
        *carried_slots += chain.source.len();
        let mut begin = Some(Box::new(self.carry_step(chain, first_slot)));
        for (&joint, place) in chain.target.iter().zip(places) {
            let Some(place) = place else {
                drivers[joint] = Driver::Hold;
                continue;
            };
            let source_rest = place.of(&chain.source, &self.source_rest);
            drivers[joint] = Driver::Carried(CarriedDriver {
                begin: begin.take(),
                sample: place.sample(|position| first_slot + position, None),
                rotation: source_rest.rotation.conjugate() * self.target_rest[joint].rotation,
                rotation_alpha: chain.drive.followed_rotation_alpha(),
                scale_offset: self.target_rest[joint].scale - source_rest.scale,
            });
        }
    }

    fn model_sample(&self, chain: &ChainPair, place: Place) -> Sample {
        let rest = |position: usize| self.source_rest[chain.source[position]].rotation;
        let first_axes = match place {
            Place::At(_) => None,
            Place::Between(position, _) => Some(rest(position + 1).conjugate() * rest(position)),
        };
        place.sample(|position| self.slot(chain.source[position]), first_axes)
    }

    /// `S0⁻¹ · T0`, with the axes of the joint that the sample begins at.
    fn model_rotation(&self, chain: &ChainPair, place: Place, joint: usize) -> DQuat {
        let (Place::At(position) | Place::Between(position, _)) = place;
        self.source_rest[chain.source[position]].rotation.conjugate() * self.target_rest[joint].rotation
    }

    /// Nothing where a joint of the chain stays at rest, or an alpha asks for less than the whole motion.
    fn chord_step(&self, chain: &ChainPair, places: &[Option<Place>], slot: usize) -> Option<ChordStep> {
        let chord = chain.chord?;
        #[expect(clippy::float_cmp, reason = "exactly one means the whole motion")]
        if chain.drive.followed_rotation_alpha() != 1.0
            || !(chain.drive.translation == TranslationMode::None || chain.drive.translation.is_shape())
        {
            return None;
        }
        let mut bones = Vec::with_capacity(chain.target.len());
        for (position, &joint) in chain.target.iter().enumerate() {
            let place = places[position]?;
            let next = chain.target.get(position + 1).copied().unwrap_or(chord.target_end);
            let sample = self.model_sample(chain, place);
            bones.push((sample, self.model_rotation(chain, place, joint) * self.bone(joint, next)?));
        }
        let kept = if chord.correction.has_chest() { bones.split_off(bones.len() - 1) } else { Vec::new() };
        let source_start = chain.source[chain.spacing.lead()];
        Some(ChordStep {
            slot,
            correction: chord.correction,
            target_from_source: self.chords_at_rest(source_start, chain.target[0], chord),
            source_start: self.slot(source_start),
            source_end: self.slot(chord.source_end),
            turned: bones,
            kept,
        })
    }

    /// The shortest rotation from the source's chord at rest to the target's, in the axes of the source joint that the chord begins at.
    fn chords_at_rest(&self, source_start: usize, target_start: usize, chord: Chord) -> DQuat {
        let line = |rest: &[Transform], start: usize, end: usize| {
            (rest[end].translation - rest[start].translation).try_normalize()
        };
        let source = line(&self.source_rest, source_start, chord.source_end);
        let target = line(&self.target_rest, target_start, chord.target_end);
        let Some((source, target)) = source.zip(target) else { return DQuat::IDENTITY };
        let axes = self.source_rest[source_start].rotation;
        (axes.conjugate() * DQuat::from_rotation_arc(source, target) * axes).normalize()
    }

    /// From a target joint to one below it, in the joint's own space but for its scale.
    fn bone(&self, joint: usize, below: usize) -> Option<DVec3> {
        let path = self.target.path(joint, below)?;
        let start = Transform { scale: self.target_rest[joint].scale, ..Transform::IDENTITY };
        let hold = self.mapping.target_hold.transforms();
        Some(path[1..].iter().fold(start, |above, &joint| above.then_child(&hold[joint])).translation)
    }

    fn translation(&self, chain: &ChainPair, place: Place) -> Translation {
        let alpha = chain.drive.translation_alpha;
        match chain.drive.translation {
            TranslationMode::None
            | TranslationMode::StretchUniform
            | TranslationMode::StretchBySegment
            | TranslationMode::OrientAndScale => Translation::Hold,
            TranslationMode::Absolute => Translation::Absolute { alpha },
            TranslationMode::GloballyScaled => {
                let joint = chain.source[place.nearest()];
                let parent_slot = self.source.parent(joint).and_then(|parent| self.source_slots[parent]);
                Translation::Scaled { parent_slot, factor: self.mapping.global_scale, alpha }
            }
        }
    }

    fn carry_step(&self, chain: &ChainPair, first_slot: usize) -> CarryStep {
        let target_parent = self.target.parent(chain.target[0]);
        let source_parent = self.source.parent(chain.source[0]);
        let target_rest = target_parent.map_or(Transform::IDENTITY, |joint| self.target_rest[joint]);
        let source_rest = source_parent.map_or(self.mapping.plan_from_source, |joint| self.source_rest[joint]);
        CarryStep {
            parent_from_carried: target_rest.relative(&source_rest),
            first_slot,
            joints: chain.source.iter().map(|&joint| (self.source_parent(joint), self.slot(joint))).collect(),
        }
    }

    /// Of which target joints the position is needed: those whose output has a translation, and all that they follow from. Where
    /// chains are carried along, all joints are recomputed in model space and taken back, idle ones too.
    fn target_needs(&self, drivers: &[Driver], carries: bool) -> Vec<Option<Needs>> {
        if carries {
            return vec![Some(Needs::Transform); drivers.len()];
        }
        let mut needs: Vec<Option<Needs>> = vec![None; drivers.len()];
        let mut open: Vec<(usize, Needs)> = Vec::new();
        for (joint, driver) in drivers.iter().enumerate() {
            let wanted = match driver {
                _ if self.rides[joint].is_some() => Needs::Transform,
                Driver::Hold => continue,
                Driver::Pelvis(_) | Driver::Carried(_) => Needs::Transform,
                Driver::Twist(_) | Driver::Shoulder(_) => Needs::Rotation,
                Driver::Model(model) => match model.translation {
                    Translation::Hold => Needs::Rotation,
                    Translation::Scaled { .. } | Translation::Absolute { .. } => Needs::Transform,
                },
            };
            open.push((joint, wanted));
            while let Some((joint, wanted)) = open.pop() {
                if needs[joint] == Some(Needs::Transform) || needs[joint] == Some(wanted) {
                    continue;
                }
                needs[joint] = Some(wanted);
                open.extend(self.target.parent(joint).map(|parent| (parent, wanted)));
                open.extend(self.rides[joint].map(|ride| (ride.on, Needs::Transform)));
            }
        }
        needs
    }

    /// Numbers the steps. Joints that nothing drives and that hang below constants only are folded into the constant.
    fn lay_out_target(
        &self,
        mut drivers: Vec<Driver>,
        needs: &[Option<Needs>],
    ) -> (Vec<TargetStep>, Vec<Option<usize>>) {
        let above = Parent::Constant(Transform::from_rotation(self.mapping.plan_from_target));
        let mut parents: Vec<Parent> = vec![above; drivers.len()];
        let mut slots: Vec<Option<usize>> = vec![None; drivers.len()];
        let mut steps: Vec<TargetStep> = Vec::new();
        for joint in carried_order(self.target, &self.rides) {
            let mut driver = std::mem::replace(&mut drivers[joint], Driver::Hold);
            if let Driver::Twist(twist) = &mut driver
                && !twist.find_slots(&slots)
            {
                // What it is measured against never moves, so there is no twist.
                driver = Driver::Hold;
            }
            let parent = self.target.parent(joint).map_or(above, |parent| parents[parent]);
            let mut hold = self.mapping.target_hold.transforms()[joint];
            if !matches!(driver, Driver::Hold | Driver::Shoulder(_)) {
                // Alphas start from the rest pose that motion is put onto, not from the one that idle joints keep.
                hold.rotation = self.local_rest_rotation(joint);
            }
            let ride = self.rides[joint].and_then(|ride| {
                let Transform { translation, rotation, .. } = ride.on_from_joint;
                slots[ride.on].map(|on| RideStep { on, translation, rotation })
            });
            parents[joint] = match (&driver, parent, needs[joint]) {
                (Driver::Hold, Parent::Constant(above), _) if ride.is_none() => {
                    Parent::Constant(above.then_child(&hold))
                }
                (_, _, Some(needs)) => {
                    slots[joint] = Some(steps.len());
                    steps.push(TargetStep { parent, hold, needs, driver, ride });
                    Parent::Slot(steps.len() - 1)
                }
                // Nothing below it is driven, so nobody asks for it as a parent.
                (_, _, None) => parent,
            };
        }
        (steps, slots)
    }

    fn local_rest_rotation(&self, joint: usize) -> DQuat {
        let above = self.mapping.plan_from_target;
        let parent = self.target.parent(joint).map_or(above, |parent| self.target_rest[parent].rotation);
        parent.conjugate() * self.target_rest[joint].rotation
    }

    fn outputs(&self, steps: &[TargetStep], slots: &[Option<usize>], carries: bool) -> Vec<Output> {
        let mut outputs = Vec::new();
        for (joint, slot) in slots.iter().enumerate() {
            let Some(slot) = *slot else { continue };
            let is_ridden = steps[slot].ride.is_some();
            let (translation, scale) = match &steps[slot].driver {
                Driver::Hold if is_ridden => (true, false),
                Driver::Hold if carries => (true, true),
                Driver::Hold => continue,
                Driver::Twist(_) | Driver::Shoulder(_) => (is_ridden, false),
                Driver::Pelvis(_) => (true, carries),
                Driver::Model(model) => (is_ridden || !matches!(model.translation, Translation::Hold), false),
                Driver::Carried(_) => (true, true),
            };
            outputs.push(Output { joint, slot, translation, scale });
        }
        outputs
    }
}

/// What a joint follows that takes the source's rotation as it is.
fn as_driven(driver: &Driver) -> Option<(Sample, DQuat)> {
    match driver {
        #[expect(clippy::float_cmp, reason = "exactly one means the whole motion")]
        Driver::Model(model) if model.chord.is_none() && model.also.is_empty() && model.rotation_alpha == 1.0 => {
            Some((model.sample, model.rotation))
        }
        _ => None,
    }
}

impl TwistDriver {
    /// Puts slots where target joints were named; whether all of them have one.
    fn find_slots(&mut self, slots: &[Option<usize>]) -> bool {
        let mut found = true;
        let mut find = |joint: &mut usize| match slots[*joint] {
            Some(slot) => *joint = slot,
            None => found = false,
        };
        if let TwistSegment::Slot(joint) = &mut self.segment {
            find(joint);
        }
        if let TwistEnd::Carrier(joint, _) = &mut self.against {
            find(joint);
        }
        found
    }
}
