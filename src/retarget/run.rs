//! The loop over frames.

use glam::{Quat, Vec3};
use rayon::prelude::*;

use crate::model::{Canceled, Clip, ClipError, Control, JointTracks, Track, Transform};

use super::{
    lanes::{LANES, QuatLanes, VecLanes},
    plan::{CarryStep, Driver, Needs, Parent, PelvisDriver, Plan, Sample, SourceStep, TargetStep, Translation},
};

/// Frames that one thread takes at a time; a multiple of [`LANES`].
const CHUNK_FRAMES: usize = 16 * LANES;

/// Retargets a clip. The result has the clip's key times and one entry per target joint; only driven joints have tracks.
///
/// Runs on the current rayon pool. The result does not depend on the number of threads.
///
/// # Errors
/// When the work is canceled, or the result does not fit into the numbers of a track.
pub fn run(plan: &Plan, clip: &Clip, control: &Control) -> Result<Clip, RunError> {
    let frames = clip.frame_count();
    let mut results: Vec<ResultTracks> =
        plan.outputs.iter().map(|output| ResultTracks::new(frames, output.translation, output.scale)).collect();
    let chunks = split_into_chunks(&mut results, frames);
    chunks.into_par_iter().try_for_each_init(
        || Workspace::new(plan),
        |workspace, mut chunk| {
            control.check()?;
            workspace.run_chunk(plan, clip.joints(), &mut chunk);
            control.advance(chunk.frames as u64);
            Ok::<(), Canceled>(())
        },
    )?;
    results.par_iter_mut().for_each(|tracks| make_continuous(&mut tracks.rotations));
    assemble(plan, clip, results)
}

/// Why a clip could not be retargeted.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// The caller no longer wants it.
    #[error(transparent)]
    Canceled(#[from] Canceled),
    /// Distances of the source times the scale between the rigs are too large for a track.
    #[error("the result is out of range: {0}")]
    OutOfRange(#[from] ClipError),
}

/// The tracks of one driven joint, while they are being filled.
struct ResultTracks {
    rotations: Vec<Quat>,
    translations: Vec<Vec3>,
    scales: Vec<Vec3>,
}

impl ResultTracks {
    fn new(frames: usize, translation: bool, scale: bool) -> Self {
        Self {
            rotations: vec![Quat::IDENTITY; frames],
            translations: vec![Vec3::ZERO; if translation { frames } else { 0 }],
            scales: vec![Vec3::ONE; if scale { frames } else { 0 }],
        }
    }
}

/// A run of frames of all results.
struct Chunk<'a> {
    first_frame: usize,
    frames: usize,
    tracks: Vec<ChunkTracks<'a>>,
}

struct ChunkTracks<'a> {
    rotations: &'a mut [Quat],
    translations: &'a mut [Vec3],
    scales: &'a mut [Vec3],
}

fn split_into_chunks(results: &mut [ResultTracks], frames: usize) -> Vec<Chunk<'_>> {
    let joints = results.len();
    let mut chunks: Vec<Chunk<'_>> = (0..frames)
        .step_by(CHUNK_FRAMES)
        .map(|first_frame| Chunk {
            first_frame,
            frames: CHUNK_FRAMES.min(frames - first_frame),
            tracks: Vec::with_capacity(joints),
        })
        .collect();
    for result in results {
        let mut rotations = result.rotations.chunks_mut(CHUNK_FRAMES);
        let mut translations = result.translations.chunks_mut(CHUNK_FRAMES);
        let mut scales = result.scales.chunks_mut(CHUNK_FRAMES);
        for chunk in &mut chunks {
            chunk.tracks.push(ChunkTracks {
                rotations: rotations.next().unwrap_or_default(),
                translations: translations.next().unwrap_or_default(),
                scales: scales.next().unwrap_or_default(),
            });
        }
    }
    chunks
}

/// Values of one joint in model space, for [`LANES`] frames.
#[derive(Clone, Copy)]
struct Slot {
    rotation: QuatLanes,
    position: VecLanes,
    scale: VecLanes,
}

impl Slot {
    const IDENTITY: Self =
        Self { rotation: QuatLanes::IDENTITY, position: VecLanes::ZERO, scale: VecLanes::splat(glam::DVec3::ONE) };

    fn splat(transform: &Transform) -> Self {
        Self {
            rotation: QuatLanes::splat(transform.rotation),
            position: VecLanes::splat(transform.translation),
            scale: VecLanes::splat(transform.scale),
        }
    }

    fn then_child(&self, child: &Self) -> Self {
        Self {
            rotation: self.rotation.times(&child.rotation),
            position: self.place(&child.position),
            scale: self.scale.times(&child.scale),
        }
    }

    /// The inverse of `then_child`, with the conjugate as the inverse rotation.
    fn relative(&self, child: &Self) -> Self {
        Self {
            rotation: self.rotation.conjugate_times(&child.rotation),
            position: self.rotation.rotate_back(&child.position.minus(&self.position)).over(&self.scale),
            scale: child.scale.over(&self.scale),
        }
    }

    /// A child's position under this.
    fn place(&self, translation: &VecLanes) -> VecLanes {
        self.position.plus(&self.rotation.rotate(&self.scale.times(translation)))
    }
}

/// What one thread works in; made once per thread and chunk run, never per frame.
struct Workspace {
    source: Vec<QuatLanes>,
    source_places: Vec<(VecLanes, VecLanes)>,
    target: Vec<Slot>,
    local_rotations: Vec<QuatLanes>,
    carried: Vec<Slot>,
}

impl Workspace {
    fn new(plan: &Plan) -> Self {
        Self {
            source: vec![QuatLanes::IDENTITY; plan.source_steps.len()],
            source_places: vec![(VecLanes::ZERO, VecLanes::ZERO); plan.source_steps.len()],
            target: vec![Slot::IDENTITY; plan.target_steps.len()],
            local_rotations: vec![QuatLanes::IDENTITY; plan.target_steps.len()],
            carried: vec![Slot::IDENTITY; plan.carried_slots],
        }
    }

    fn run_chunk(&mut self, plan: &Plan, tracks: &[JointTracks], chunk: &mut Chunk<'_>) {
        for first in (0..chunk.frames).step_by(LANES) {
            let frame = chunk.first_frame + first;
            let count = LANES.min(chunk.frames - first);
            for (slot, step) in plan.source_steps.iter().enumerate() {
                self.accumulate_source(slot, step, &tracks[step.joint], frame, count);
            }
            for (slot, step) in plan.target_steps.iter().enumerate() {
                self.compute_target(plan.normalizes, slot, step);
            }
            self.store(plan, chunk, first, count);
        }
    }

    #[inline]
    fn accumulate_source(&mut self, slot: usize, step: &SourceStep, tracks: &JointTracks, frame: usize, count: usize) {
        let local = load_rotation(&tracks.rotation, step.rest.rotation, frame, count);
        let rotation = match step.parent {
            Parent::Slot(parent) => self.source[parent].times(&local),
            Parent::Constant(above) => QuatLanes::splat(above.rotation).times(&local),
        };
        if step.needs == Needs::Transform {
            let parent = match step.parent {
                Parent::Slot(parent) => self.source_slot(parent),
                Parent::Constant(above) => Slot::splat(&above),
            };
            let translation = load_vector(&tracks.translation, step.rest.translation, frame, count);
            let scale = load_vector(&tracks.scale, step.rest.scale, frame, count);
            self.source_places[slot] = (parent.place(&translation), parent.scale.times(&scale));
        }
        self.source[slot] = rotation;
    }

    #[inline]
    fn compute_target(&mut self, normalizes: bool, slot: usize, step: &TargetStep) {
        match &step.driver {
            Driver::Hold => self.hold(slot, step),
            Driver::Model(driver) => {
                let wanted = self.sample_source(driver.sample).times_constant(driver.rotation);
                self.turn(normalizes, slot, step, wanted, driver.rotation_alpha);
                if step.needs == Needs::Transform {
                    let parent = self.parent(step);
                    let mut position = parent.place(&VecLanes::splat(step.hold.translation));
                    if let Some((moved, alpha)) = self.moved(driver.sample, driver.translation, &parent) {
                        position = position.blend(&moved, alpha);
                    }
                    self.target[slot].position = position;
                    self.target[slot].scale = parent.scale.times(&VecLanes::splat(step.hold.scale));
                }
            }
            Driver::Pelvis(driver) => {
                let wanted = self.source[driver.source_slot].times_constant(driver.rotation).normalized();
                self.turn(normalizes, slot, step, wanted, driver.rotation_alpha);
                self.target[slot].position = pelvis_position(driver, &self.source_places[driver.source_slot].0);
                self.target[slot].scale = VecLanes::splat(driver.rest_scale);
            }
            Driver::Carried(driver) => {
                let parent = self.parent(step);
                if let Some(begin) = &driver.begin {
                    self.carry(begin, &parent);
                }
                let (rotation, scale) = self.sample_carried(driver.sample);
                self.turn(normalizes, slot, step, rotation.times_constant(driver.rotation), driver.rotation_alpha);
                self.target[slot].position = parent.place(&VecLanes::splat(step.hold.translation));
                self.target[slot].scale = scale.plus(&VecLanes::splat(driver.scale_offset));
            }
        }
    }

    fn parent(&self, step: &TargetStep) -> Slot {
        match step.parent {
            Parent::Slot(parent) => self.target[parent],
            Parent::Constant(above) => Slot::splat(&above),
        }
    }

    fn hold(&mut self, slot: usize, step: &TargetStep) {
        let parent = self.parent(step);
        self.target[slot].rotation = parent.rotation.times_constant(step.hold.rotation);
        if step.needs == Needs::Transform {
            self.target[slot].position = parent.place(&VecLanes::splat(step.hold.translation));
            self.target[slot].scale = parent.scale.times(&VecLanes::splat(step.hold.scale));
            self.local_rotations[slot] = parent.rotation.conjugate_times(&self.target[slot].rotation);
        }
    }

    /// Sets a joint's rotation in model space, and what it is relative to its parent.
    #[inline]
    fn turn(&mut self, normalizes: bool, slot: usize, step: &TargetStep, wanted: QuatLanes, alpha: f64) {
        let parent = match step.parent {
            Parent::Slot(parent) => self.target[parent].rotation,
            Parent::Constant(above) => QuatLanes::splat(above.rotation),
        };
        let mut local = parent.conjugate_times(&wanted);
        if normalizes {
            local = local.normalized();
        }
        let mut rotation = wanted;
        #[expect(clippy::float_cmp, reason = "exactly one means that there is nothing to blend")]
        if alpha != 1.0 {
            local = local.scaled_from(step.hold.rotation, alpha);
            rotation = parent.times(&local);
        }
        self.target[slot].rotation = rotation;
        self.local_rotations[slot] = local;
    }

    #[inline]
    fn sample_source(&self, sample: Sample) -> QuatLanes {
        match sample {
            Sample::At(slot) => self.source[slot],
            Sample::Between { first, second, fraction } => self.source[first].blend(&self.source[second], fraction),
        }
    }

    fn sample_source_position(&self, sample: Sample) -> VecLanes {
        match sample {
            Sample::At(slot) => self.source_places[slot].0,
            Sample::Between { first, second, fraction } => {
                self.source_places[first].0.blend(&self.source_places[second].0, fraction)
            }
        }
    }

    /// Where a translation mode puts a joint, and how much of it is wanted.
    fn moved(&self, sample: Sample, translation: Translation, parent: &Slot) -> Option<(VecLanes, f64)> {
        match translation {
            Translation::Hold => None,
            Translation::Absolute { alpha } => Some((self.sample_source_position(sample), alpha)),
            Translation::Scaled { parent_slot, factor, alpha } => {
                let from = parent_slot.map_or(VecLanes::ZERO, |slot| self.source_places[slot].0);
                let offset = self.sample_source_position(sample).minus(&from);
                let scaled = offset.times(&VecLanes::splat(glam::DVec3::splat(factor)));
                Some((parent.position.plus(&scaled), alpha))
            }
        }
    }

    fn carry(&mut self, step: &CarryStep, parent: &Slot) {
        let mut current = parent.then_child(&Slot::splat(&step.parent_from_carried));
        for (offset, (above, joint)) in step.joints.iter().enumerate() {
            let above = match above {
                Parent::Slot(slot) => self.source_slot(*slot),
                Parent::Constant(above) => Slot::splat(above),
            };
            current = current.then_child(&above.relative(&self.source_slot(*joint)));
            self.carried[step.first_slot + offset] = current;
        }
    }

    fn source_slot(&self, slot: usize) -> Slot {
        let (position, scale) = self.source_places[slot];
        Slot { rotation: self.source[slot], position, scale }
    }

    fn sample_carried(&self, sample: Sample) -> (QuatLanes, VecLanes) {
        match sample {
            Sample::At(slot) => (self.carried[slot].rotation, self.carried[slot].scale),
            Sample::Between { first, second, fraction } => (
                self.carried[first].rotation.blend(&self.carried[second].rotation, fraction),
                self.carried[first].scale.blend(&self.carried[second].scale, fraction),
            ),
        }
    }

    fn store(&self, plan: &Plan, chunk: &mut Chunk<'_>, first: usize, count: usize) {
        for (output, tracks) in plan.outputs.iter().zip(&mut chunk.tracks) {
            self.local_rotations[output.slot].store(&mut tracks.rotations[first..first + count]);
            if !output.translation {
                continue;
            }
            let parent = self.parent(&plan.target_steps[output.slot]);
            let local = parent.relative(&self.target[output.slot]);
            local.position.store(&mut tracks.translations[first..first + count]);
            if output.scale {
                local.scale.store(&mut tracks.scales[first..first + count]);
            }
        }
    }
}

fn pelvis_position(driver: &PelvisDriver, source: &VecLanes) -> VecLanes {
    let mut result = VecLanes::ZERO;
    let (columns, offset) = (driver.matrix, driver.offset);
    for lane in 0..LANES {
        let wanted = columns * glam::DVec3::new(source.x[lane], source.y[lane], source.z[lane]) + offset;
        let placed = driver.rest_position.lerp(wanted, driver.translation_alpha);
        (result.x[lane], result.y[lane], result.z[lane]) = placed.into();
    }
    result
}

#[inline]
fn load_rotation(track: &Track<Quat>, rest: glam::DQuat, frame: usize, count: usize) -> QuatLanes {
    match track {
        Track::Sampled(values) => QuatLanes::load(&values[frame..frame + count]),
        Track::Constant(value) => QuatLanes::splat(value.as_dquat()),
        Track::Rest => QuatLanes::splat(rest),
    }
}

#[inline]
fn load_vector(track: &Track<Vec3>, rest: glam::DVec3, frame: usize, count: usize) -> VecLanes {
    match track {
        Track::Sampled(values) => VecLanes::load(&values[frame..frame + count]),
        Track::Constant(value) => VecLanes::splat(value.as_dvec3()),
        Track::Rest => VecLanes::splat(rest),
    }
}

/// q and −q are the same rotation; players interpolate the short way only when neighbours lie on one hemisphere.
fn make_continuous(rotations: &mut [Quat]) {
    for frame in 1..rotations.len() {
        if rotations[frame].dot(rotations[frame - 1]) < 0.0 {
            rotations[frame] = -rotations[frame];
        }
    }
}

fn assemble(plan: &Plan, clip: &Clip, results: Vec<ResultTracks>) -> Result<Clip, RunError> {
    let mut joints = vec![JointTracks::default(); plan.target_joint_count];
    for (output, result) in plan.outputs.iter().zip(results) {
        joints[output.joint] = JointTracks {
            rotation: Track::Sampled(result.rotations),
            translation: if output.translation { Track::Sampled(result.translations) } else { Track::Rest },
            scale: if output.scale { Track::Sampled(result.scales) } else { Track::Rest },
        };
    }
    Ok(Clip::new(clip.name().to_owned(), clip.times_seconds().to_vec(), joints)?)
}
