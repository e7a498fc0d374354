//! The loop over frames, in parallel.

use bytemuck::zeroed_vec;
use glam::{Quat, Vec3};
use rayon::prelude::*;

use crate::model::{Canceled, Clip, ClipError, Control, JointTracks, Track};

use super::{
    lanes::LANES,
    plan::Plan,
    workspace::{Chunk, ChunkTracks, Workspace},
};

/// Frames that one thread takes at a time; a multiple of [`LANES`].
const CHUNK_FRAMES: usize = 16 * LANES;

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

/// Retargets a clip. The result has the clip's key times and one entry per target joint; only driven joints have tracks.
///
/// Runs on the current rayon pool. The result does not depend on the number of threads.
///
/// # Errors
/// When the work is canceled, or the result does not fit into the numbers of a track.
pub fn run(plan: &Plan, clip: &Clip, control: &Control) -> Result<Clip, RunError> {
    let frames = clip.frame_count();
    let mut results: Vec<ResultTracks> =
        plan.outputs.par_iter().map(|output| ResultTracks::new(frames, output.translation, output.scale)).collect();
    let chunks = split_into_chunks(&mut results, frames);
    let fill = |workspace: &mut Workspace, mut chunk: Chunk<'_>| {
        control.check()?;
        workspace.run(plan, clip.joints(), &mut chunk);
        control.advance(chunk.frames as u64);
        Ok::<bool, Canceled>(chunk.tracks.iter().all(|tracks| tracks.is_finite))
    };
    let is_finite = chunks
        .into_par_iter()
        .map_init(|| Workspace::new(plan), fill)
        .try_reduce(|| true, |before, chunk| Ok(before && chunk))?;
    results.par_iter_mut().for_each(|tracks| join_hemispheres(&mut tracks.rotations));
    let (name, times) = (clip.name().to_owned(), clip.times_seconds().to_vec());
    let joints = assemble(plan, results);
    Ok(if is_finite { Clip::of_checked(name, times, joints) } else { Clip::new(name, times, joints)? })
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
            // Zeroed by the allocator: fresh pages are zero already.
            rotations: zeroed_vec(frames),
            translations: zeroed_vec(if translation { frames } else { 0 }),
            scales: zeroed_vec(if scale { frames } else { 0 }),
        }
    }
}

fn split_into_chunks(results: &mut [ResultTracks], frames: usize) -> Vec<Chunk<'_>> {
    let joints = results.len();
    let empty = |first_frame: usize| Chunk {
        first_frame,
        frames: CHUNK_FRAMES.min(frames - first_frame),
        tracks: Vec::with_capacity(joints),
    };
    let mut chunks: Vec<Chunk<'_>> = (0..frames).step_by(CHUNK_FRAMES).map(empty).collect();
    for result in results {
        let mut rotations = result.rotations.chunks_mut(CHUNK_FRAMES);
        let mut translations = result.translations.chunks_mut(CHUNK_FRAMES);
        let mut scales = result.scales.chunks_mut(CHUNK_FRAMES);
        for chunk in &mut chunks {
            chunk.tracks.push(ChunkTracks {
                rotations: rotations.next().unwrap_or_default(),
                translations: translations.next().unwrap_or_default(),
                scales: scales.next().unwrap_or_default(),
                before: Quat::IDENTITY,
                is_finite: true,
            });
        }
    }
    chunks
}

/// q and −q are the same rotation; players interpolate the short way only when neighbors lie on one hemisphere. Within a chunk
/// they do already; a chunk that begins on the other one is turned over as a whole.
fn join_hemispheres(rotations: &mut [Quat]) {
    let mut before = Quat::IDENTITY;
    for chunk in rotations.chunks_mut(CHUNK_FRAMES) {
        if chunk[0].dot(before) < 0.0 {
            chunk.iter_mut().for_each(|rotation| *rotation = -*rotation);
        }
        before = chunk[chunk.len() - 1];
    }
}

fn assemble(plan: &Plan, results: Vec<ResultTracks>) -> Vec<JointTracks> {
    let mut joints = vec![JointTracks::default(); plan.target_joint_count];
    for (output, result) in plan.outputs.iter().zip(results) {
        joints[output.joint] = JointTracks {
            rotation: Track::Sampled(result.rotations),
            translation: if output.translation { Track::Sampled(result.translations) } else { Track::Rest },
            scale: if output.scale { Track::Sampled(result.scales) } else { Track::Rest },
        };
    }
    joints
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        model::Reporter,
        retarget::{resolve::resolve, spec::parse_spec},
        rig::Rig,
        samples,
    };

    #[test]
    fn what_no_track_can_hold_is_told_with_its_frame() {
        let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
        let far = source.clips[0].frame_count() - 1;
        let mut joints = source.clips[0].joints().to_vec();
        let Track::Sampled(places) = &mut joints[0].translation else { panic!("the walk travels") };
        places[far] = Vec3::X * 3e38;
        let clip = source.clips[0].clone().with_joints(joints).expect("it is finite");
        let spec = parse_spec(br#"{"ops": [{"op": "pelvis", "scale": 2.0}, {"op": "fk"}]}"#).expect("a spec");
        let mut reporter = Reporter::new();
        let source = Rig::new("source", &source, None, &spec.source, &mut reporter).expect("a rig");
        let target = Rig::new("target", &target, None, &spec.target, &mut reporter).expect("a rig");
        let resolved = resolve(&spec, &source, &target, &clip, &mut reporter).expect("it maps");
        let plan = Plan::new(source.skeleton(), target.skeleton(), &resolved.mapping);
        let error = run(&plan, &clip, &Control::new()).expect_err("twice as far is too far");
        assert!(
            matches!(error, RunError::OutOfRange(ClipError::NotFinite { frame, .. }) if frame == far),
            "{error} at frame {far}"
        );
    }
}
