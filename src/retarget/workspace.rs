//! What one thread works in: the joints of both sides for a few frames.

use std::{hint::black_box, ops::Range};

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::model::{JointTracks, Track, Transform};

use super::{
    chord::chord_turn_lanes,
    direct::Active,
    lanes::{LANES, QuatLanes, VecLanes},
    plan::{
        CarryStep, ChordStep, Driver, ModelDriver, Needs, Output, Parent, PelvisDriver, PelvisFurther, Plan, RideStep,
        Sample, ShoulderDriver, SourceStep, TargetStep, Translation, TwistDriver, TwistEnd, TwistSegment, mean_share,
    },
    vectors::{Vectorized, Vectors},
};

/// Rotations in what memory hands over at once.
const LINE: usize = 64 / size_of::<Quat>();

/// A run of frames of all results.
pub(super) struct Chunk<'a> {
    pub(super) first_frame: usize,
    pub(super) frames: usize,
    /// One entry per output that the loop fills.
    pub(super) tracks: Vec<ChunkTracks<'a>>,
}

/// A run of frames of one driven joint's results.
pub(super) struct ChunkTracks<'a> {
    pub(super) rotations: &'a mut [Quat],
    pub(super) translations: &'a mut [Vec3],
    pub(super) scales: &'a mut [Vec3],
    /// The rotation before the one that is written next; its hemisphere is kept.
    pub(super) before: Quat,
    /// Whether all that was written is finite.
    pub(super) is_finite: bool,
}

/// Position and scale of one joint in plan space.
#[derive(Clone, Copy)]
struct Place {
    position: VecLanes,
    scale: VecLanes,
}

impl Place {
    const ORIGIN: Self = Self { position: VecLanes::ZERO, scale: VecLanes::splat(DVec3::ONE) };

    #[inline(always)]
    fn splat(transform: &Transform) -> Self {
        Self { position: VecLanes::splat(transform.translation), scale: VecLanes::splat(transform.scale) }
    }
}

/// Rotation and place together, where speed does not matter.
#[derive(Clone, Copy)]
struct Frame {
    rotation: QuatLanes,
    place: Place,
}

impl Frame {
    const IDENTITY: Self = Self { rotation: QuatLanes::IDENTITY, place: Place::ORIGIN };

    #[inline(always)]
    fn splat(transform: &Transform) -> Self {
        Self { rotation: QuatLanes::splat(transform.rotation), place: Place::splat(transform) }
    }

    #[inline(always)]
    fn point(&self, point: &VecLanes) -> VecLanes {
        self.place.position.plus(&self.rotation.rotate(&self.place.scale.times(point)))
    }

    #[inline(always)]
    fn then_child(&self, child: &Self) -> Self {
        let place =
            Place { position: self.point(&child.place.position), scale: self.place.scale.times(&child.place.scale) };
        Self { rotation: self.rotation.times(&child.rotation), place }
    }

    /// The inverse of `then_child`, with the conjugate as the inverse rotation.
    #[inline(always)]
    fn relative(&self, child: &Self) -> Self {
        let offset = self.rotation.rotate_back(&child.place.position.minus(&self.place.position));
        let place =
            Place { position: offset.over(&self.place.scale), scale: child.place.scale.over(&self.place.scale) };
        Self { rotation: self.rotation.conjugate_times(&child.rotation), place }
    }
}

/// Slots of both sides. Made once per run of chunks, never per frame.
pub(super) struct Workspace {
    source: Vec<QuatLanes>,
    source_places: Vec<Place>,
    target: Vec<QuatLanes>,
    target_places: Vec<Place>,
    carried: Vec<Frame>,
    chords: Vec<QuatLanes>,
    /// A joint's local rotation, on its way in or out.
    local: QuatLanes,
}

/// A chunk that is run.
struct Run<'a, 'c> {
    workspace: &'a mut Workspace,
    plan: &'a Plan,
    active: &'a Active,
    tracks: &'a [JointTracks],
    chunk: &'a mut Chunk<'c>,
}

impl Vectorized for Run<'_, '_> {
    #[inline(always)]
    fn run(self) {
        self.workspace.run_frames(self.plan, self.active, self.tracks, self.chunk);
    }
}

impl Workspace {
    pub(super) fn new(plan: &Plan) -> Self {
        Self {
            source: vec![QuatLanes::IDENTITY; plan.source_steps.len()],
            source_places: vec![Place::ORIGIN; plan.source_steps.len()],
            target: vec![QuatLanes::IDENTITY; plan.target_steps.len()],
            target_places: vec![Place::ORIGIN; plan.target_steps.len()],
            carried: vec![Frame::IDENTITY; plan.carried_slots],
            chords: vec![QuatLanes::IDENTITY; plan.chord_slots],
            local: QuatLanes::IDENTITY,
        }
    }

    /// Retargets a chunk, [`LANES`] frames at a time.
    ///
    /// The same code is compiled for all [`Vectors`].
    pub(super) fn run(&mut self, plan: &Plan, active: &Active, tracks: &[JointTracks], chunk: &mut Chunk<'_>) {
        Vectors::detected().run(Run { workspace: self, plan, active, tracks, chunk });
    }

    #[inline(always)]
    fn run_frames(&mut self, plan: &Plan, active: &Active, tracks: &[JointTracks], chunk: &mut Chunk<'_>) {
        for first in (0..chunk.frames).step_by(LANES) {
            let frame = chunk.first_frame + first;
            let span = Span { frame, in_chunk: first, count: LANES.min(chunk.frames - first) };
            for &slot in &active.source {
                let step = &plan.source_steps[slot];
                self.accumulate(slot, step, &tracks[step.joint], span);
            }
            for &(slot, output) in &active.target {
                let step = &plan.target_steps[slot];
                self.compute(slot, step);
                if let Some(index) = output {
                    self.store(plan, slot, step, &active.outputs[index], &mut chunk.tracks[index], span);
                }
            }
        }
    }

    #[inline(always)]
    fn accumulate(&mut self, slot: usize, step: &SourceStep, tracks: &JointTracks, span: Span) {
        if let Track::Sampled(values) = &tracks.rotation {
            self.local.load(&values[span.in_clip()]);
            ask_for(&values[span.next_in_clip(values.len())]);
        }
        let (done, rest) = self.source.split_at_mut(slot);
        let result = &mut rest[0];
        match (&tracks.rotation, step.parent) {
            (Track::Sampled(_), Parent::Slot(parent)) => result.set_product(&done[parent], &self.local),
            (Track::Sampled(_), Parent::Constant(above)) => {
                result.set_product_of_constant(above.rotation, &self.local);
            }
            (still, parent) => {
                let local = if let Track::Constant(value) = still { value.as_dquat() } else { step.rest.rotation };
                match parent {
                    Parent::Slot(parent) => result.set_product_with_constant(&done[parent], local),
                    Parent::Constant(above) => *result = QuatLanes::splat(above.rotation * local),
                }
            }
        }
        if step.needs == Needs::Transform {
            let parent = self.source_parent(step.parent);
            let translation = load_vector(&tracks.translation, step.rest.translation, span);
            let scale = load_vector(&tracks.scale, step.rest.scale, span);
            self.source_places[slot] =
                Place { position: parent.point(&translation), scale: parent.place.scale.times(&scale) };
        }
    }

    #[inline(always)]
    fn compute(&mut self, slot: usize, step: &TargetStep) {
        match &step.driver {
            Driver::Hold => self.hold(slot, step),
            Driver::Model(driver) => self.follow(slot, step, driver),
            Driver::Pelvis(driver) => self.move_pelvis(slot, step, driver),
            Driver::Twist(driver) => self.twist(slot, step, driver),
            Driver::Shoulder(driver) => self.lift_shoulder(slot, step, driver),
            Driver::Carried(driver) => {
                let parent = self.target_parent(step.parent);
                if let Some(begin) = &driver.begin {
                    self.carry(begin, &parent);
                }
                let (rotation, scale) = self.sample_carried(driver.sample);
                self.target[slot].set_product_with_constant(&rotation, driver.rotation);
                self.blend_rotation(slot, step, driver.rotation_alpha);
                self.target_places[slot] = Place {
                    position: parent.point(&VecLanes::splat(step.hold.translation)),
                    scale: scale.plus(&VecLanes::splat(driver.scale_offset)),
                };
            }
        }
    }

    #[inline(always)]
    fn hold(&mut self, slot: usize, step: &TargetStep) {
        if let Some(ride) = &step.ride {
            self.target[slot] = self.target[ride.on].times_constant(ride.rotation);
            let scale = self.target_parent(step.parent).place.scale.times(&VecLanes::splat(step.hold.scale));
            self.target_places[slot] = Place { position: self.ridden_position(ride), scale };
            return;
        }
        let (done, rest) = self.target.split_at_mut(slot);
        match step.parent {
            Parent::Slot(parent) => rest[0].set_product_with_constant(&done[parent], step.hold.rotation),
            Parent::Constant(above) => rest[0] = QuatLanes::splat(above.rotation * step.hold.rotation),
        }
        if step.needs == Needs::Transform {
            let parent = self.target_parent(step.parent);
            self.target_places[slot] = Place {
                position: parent.point(&VecLanes::splat(step.hold.translation)),
                scale: parent.place.scale.times(&VecLanes::splat(step.hold.scale)),
            };
        }
    }

    #[inline(always)]
    fn follow(&mut self, slot: usize, step: &TargetStep, driver: &ModelDriver) {
        match driver.sample {
            Sample::At(source) => self.target[slot].set_product_with_constant(&self.source[source], driver.rotation),
            Sample::Between { first, second, fraction, first_axes } => {
                let between = self.between(first, second, fraction, first_axes);
                self.target[slot].set_product_with_constant(&between, driver.rotation);
            }
        }
        for (taken, (sample, rotation)) in driver.also.iter().enumerate() {
            let other = self.sample_rotation(*sample).times_constant(*rotation);
            self.target[slot] = self.target[slot].blend(&other, mean_share(taken));
        }
        if let Some(begin) = &driver.begin {
            self.turn_chord(begin);
        }
        if let Some(chord) = driver.chord {
            self.target[slot] = self.chords[chord].times(&self.target[slot]);
        }
        self.blend_rotation(slot, step, driver.rotation_alpha);
        if step.needs == Needs::Transform {
            let parent = self.target_parent(step.parent);
            let mut place = self.rest_place(step, &parent);
            if let Some((moved, alpha)) = self.moved(driver.sample, driver.translation, &parent) {
                place.position = place.position.blend(&moved, alpha);
            }
            self.target_places[slot] = place;
        }
    }

    #[inline(never)]
    fn twist(&mut self, slot: usize, step: &TargetStep, driver: &TwistDriver) {
        let segment = match driver.segment {
            TwistSegment::Slot(slot) => self.target[slot],
            TwistSegment::Source(sample, rotation) => self.sample_rotation(sample).times_constant(rotation),
        };
        let change = match driver.against {
            TwistEnd::Carrier(carrier, carrier_from_segment) => QuatLanes::splat(carrier_from_segment.conjugate())
                .times(&self.target[carrier].conjugate_times(&segment)),
            TwistEnd::End(sample, rotation, end_from_segment) => {
                let end = self.sample_rotation(sample).times_constant(rotation);
                segment.conjugate_times(&end).times_constant(end_from_segment)
            }
        };
        let turn = change.twist_share(driver.axis, driver.share);
        self.target[slot] = segment.times(&turn).times_constant(driver.segment_from_joint);
        if step.needs == Needs::Transform {
            let parent = self.target_parent(step.parent);
            self.target_places[slot] = self.rest_place(step, &parent);
        }
    }

    #[inline(never)]
    fn lift_shoulder(&mut self, slot: usize, step: &TargetStep, driver: &ShoulderDriver) {
        let parent = self.target_parent(step.parent);
        let arm =
            self.sample_rotation(driver.sample).times_constant(driver.rotation).rotate(&VecLanes::splat(driver.arm));
        let up = parent.rotation.rotate(&VecLanes::splat(driver.up));
        let mut lift = QuatLanes::IDENTITY;
        for lane in 0..LANES {
            let beyond = (arm.get(lane).angle_between(-up.get(lane)) - driver.free_radians).max(0.0);
            lift.set(lane, DQuat::from_axis_angle(driver.axis, beyond * driver.share));
        }
        self.target[slot] = parent.rotation.times(&lift).times_constant(step.hold.rotation);
        if step.needs == Needs::Transform {
            self.target_places[slot] = self.rest_place(step, &parent);
        }
    }

    /// Where a joint is whose bone keeps its length.
    #[inline(always)]
    fn rest_place(&self, step: &TargetStep, parent: &Frame) -> Place {
        let position = match &step.ride {
            Some(ride) => self.ridden_position(ride),
            None => parent.point(&VecLanes::splat(step.hold.translation)),
        };
        Place { position, scale: parent.place.scale.times(&VecLanes::splat(step.hold.scale)) }
    }

    /// Fills the slots of a chord: the rotations of the turned bones and of the chest's.
    #[inline(always)]
    fn turn_chord(&mut self, step: &ChordStep) {
        let (turned, chest) = (self.sum_of(&step.turned), self.sum_of(&step.kept));
        let (start, end) = (&self.source_places[step.source_start], &self.source_places[step.source_end]);
        let along = end.position.minus(&start.position);
        let axes = &self.source[step.source_start];
        let wanted = axes.times_constant(step.target_from_source).rotate(&axes.rotate_back(&along));
        let turns = chord_turn_lanes(step.correction, &turned, &chest, &wanted);
        self.chords[step.slot] = turns.below;
        if step.correction.has_chest() {
            self.chords[step.slot + 1] = turns.chest;
        }
    }

    /// Where bones lead that each follow a place of the source.
    #[inline(always)]
    fn sum_of(&self, bones: &[(Sample, DVec3)]) -> VecLanes {
        bones.iter().fold(VecLanes::ZERO, |sum, (sample, bone)| {
            sum.plus(&self.sample_rotation(*sample).rotate(&VecLanes::splat(*bone)))
        })
    }

    #[inline(always)]
    fn sample_rotation(&self, sample: Sample) -> QuatLanes {
        match sample {
            Sample::At(slot) => self.source[slot],
            Sample::Between { first, second, fraction, first_axes } => {
                self.between(first, second, fraction, first_axes)
            }
        }
    }

    #[inline(always)]
    fn between(&self, first: usize, second: usize, fraction: f64, first_axes: Option<DQuat>) -> QuatLanes {
        match first_axes {
            Some(axes) => self.source[first].blend(&self.source[second].times_constant(axes), fraction),
            None => self.source[first].blend(&self.source[second], fraction),
        }
    }

    #[inline(always)]
    fn move_pelvis(&mut self, slot: usize, step: &TargetStep, driver: &PelvisDriver) {
        self.target[slot] = self.source[driver.source_slot].times_constant(driver.rotation).normalized();
        if let Some(further) = &driver.further {
            self.target[slot] = QuatLanes::splat(further.turn).times(&self.target[slot]);
        }
        self.blend_rotation(slot, step, driver.rotation_alpha);
        let source = &self.source_places[driver.source_slot].position;
        let further = driver.further.as_ref().map(|further| further.moved(source, &self.target[slot]));
        let mut position = VecLanes::ZERO;
        for lane in 0..LANES {
            let mut wanted = driver.matrix * source.get(lane) + driver.offset;
            if let Some(further) = &further {
                wanted += further.get(lane);
            }
            let placed = driver.rest_position.lerp(wanted, driver.translation_alpha);
            position.set(lane, placed);
        }
        self.target_places[slot] = Place { position, scale: VecLanes::splat(driver.rest_scale) };
    }

    /// Goes back toward the rest rotation below the parent where the alpha is not one.
    #[inline(always)]
    fn blend_rotation(&mut self, slot: usize, step: &TargetStep, alpha: f64) {
        #[expect(clippy::float_cmp, reason = "exactly one means that there is nothing to blend")]
        if alpha == 1.0 {
            return;
        }
        let parent = self.target_parent(step.parent).rotation;
        let local = parent.conjugate_times(&self.target[slot]).normalized();
        self.target[slot] = parent.times(&local.scaled_from(step.hold.rotation, alpha));
    }

    #[inline(always)]
    fn source_parent(&self, parent: Parent) -> Frame {
        match parent {
            Parent::Slot(slot) => Frame { rotation: self.source[slot], place: self.source_places[slot] },
            Parent::Constant(above) => Frame::splat(&above),
        }
    }

    #[inline(always)]
    fn target_parent(&self, parent: Parent) -> Frame {
        match parent {
            Parent::Slot(slot) => Frame { rotation: self.target[slot], place: self.target_places[slot] },
            Parent::Constant(above) => Frame::splat(&above),
        }
    }

    #[inline(always)]
    fn ridden_position(&self, ride: &RideStep) -> VecLanes {
        self.target_parent(Parent::Slot(ride.on)).point(&VecLanes::splat(ride.translation))
    }

    #[inline(always)]
    fn sample_position(&self, sample: Sample) -> VecLanes {
        match sample {
            Sample::At(slot) => self.source_places[slot].position,
            Sample::Between { first, second, fraction, .. } => {
                self.source_places[first].position.blend(&self.source_places[second].position, fraction)
            }
        }
    }

    /// Where a translation mode puts a joint, and how much of it is wanted.
    #[inline(always)]
    fn moved(&self, sample: Sample, translation: Translation, parent: &Frame) -> Option<(VecLanes, f64)> {
        match translation {
            Translation::Hold => None,
            Translation::Absolute { alpha } => Some((self.sample_position(sample), alpha)),
            Translation::Scaled { parent_slot, factor, alpha } => {
                let from = parent_slot.map_or(VecLanes::ZERO, |slot| self.source_places[slot].position);
                let offset = self.sample_position(sample).minus(&from);
                let scaled = offset.times(&VecLanes::splat(DVec3::splat(factor)));
                Some((parent.place.position.plus(&scaled), alpha))
            }
        }
    }

    fn carry(&mut self, step: &CarryStep, parent: &Frame) {
        let mut current = parent.then_child(&Frame::splat(&step.parent_from_carried));
        for (offset, (above, joint)) in step.joints.iter().enumerate() {
            let above = self.source_parent(*above);
            current = current.then_child(&above.relative(&self.source_parent(Parent::Slot(*joint))));
            self.carried[step.first_slot + offset] = current;
        }
    }

    fn sample_carried(&self, sample: Sample) -> (QuatLanes, VecLanes) {
        match sample {
            Sample::At(slot) => (self.carried[slot].rotation, self.carried[slot].place.scale),
            Sample::Between { first, second, fraction, .. } => {
                let (first, second) = (&self.carried[first], &self.carried[second]);
                let scale = first.place.scale.blend(&second.place.scale, fraction);
                (first.rotation.blend(&second.rotation, fraction), scale)
            }
        }
    }

    #[inline(always)]
    fn store(
        &mut self,
        plan: &Plan,
        slot: usize,
        step: &TargetStep,
        output: &Output,
        tracks: &mut ChunkTracks<'_>,
        span: Span,
    ) {
        let range = span.in_chunk..span.in_chunk + span.count;
        match step.parent {
            Parent::Slot(parent) => self.local.set_relative(&self.target[parent], &self.target[slot]),
            Parent::Constant(above) => {
                self.local.set_product_of_constant(DQuat::conjugate(above.rotation), &self.target[slot]);
            }
        }
        let is_near = plan.normalizes && self.local.refine_length();
        let rotations = &mut tracks.rotations[range.clone()];
        self.local.store(rotations, &mut tracks.before);
        tracks.is_finite &= is_near || rotations.iter().all(|rotation| rotation.is_finite());
        if output.translation {
            let joint = Frame { rotation: self.target[slot], place: self.target_places[slot] };
            let local = self.target_parent(step.parent).relative(&joint).place;
            tracks.is_finite &= local.position.store(&mut tracks.translations[range.clone()]);
            if output.scale {
                tracks.is_finite &= local.scale.store(&mut tracks.scales[range]);
            }
        }
    }
}

impl PelvisFurther {
    /// How far the pelvis is moved beside its scale, where the source's is at `source` and the target's is turned by `rotation`.
    fn moved(&self, source: &VecLanes, rotation: &QuatLanes) -> VecLanes {
        let mut moved = rotation.rotate(&VecLanes::splat(self.local_offset));
        if let Some(crotch) = &self.crotch {
            for lane in 0..LANES {
                let raised = crotch.up * crotch.raise(source.get(lane));
                moved.set(lane, moved.get(lane) + raised);
            }
        }
        moved
    }
}

/// Which frames are being worked on: the first one's index in the clip and in the chunk, and how many.
#[derive(Clone, Copy)]
struct Span {
    frame: usize,
    in_chunk: usize,
    count: usize,
}

impl Span {
    fn in_clip(self) -> Range<usize> {
        self.frame..self.frame + self.count
    }

    /// What comes after it, in a clip of so many frames.
    fn next_in_clip(self, frames: usize) -> Range<usize> {
        let begin = self.frame + self.count;
        begin..(begin + LANES).min(frames)
    }
}

/// Reads a little of every [`LINE`] of the samples that are needed next, so that they are near by then.
///
/// A track is one long run of memory, and the loop reads a few frames of each in turn: it would wait for every one of them. Nothing
/// waits for what is read here.
#[inline(always)]
fn ask_for(samples: &[Quat]) {
    black_box(samples.iter().step_by(LINE).fold(0, |read, sample| read | sample.x.to_bits()));
}

fn load_vector(track: &Track<Vec3>, rest: DVec3, span: Span) -> VecLanes {
    match track {
        Track::Sampled(values) => VecLanes::load(&values[span.in_clip()]),
        Track::Constant(value) => VecLanes::splat(value.as_dvec3()),
        Track::Rest => VecLanes::splat(rest),
    }
}
