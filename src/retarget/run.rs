//! A plan on a clip: tracks that follow directly, and the loop over frames for the others, both in parallel.

use bytemuck::zeroed_vec;
use glam::{Quat, Vec3};
use rayon::prelude::*;

use crate::model::{Canceled, Clip, ClipError, Control, JointTracks, Track};

use super::{
    direct::{self, Active, Direct, Filled},
    lanes::LANES,
    plan::{Output, Plan},
    workspace::{Chunk, ChunkTracks, Workspace},
};

/// Frames that one thread takes at a time; a multiple of [`LANES`].
const CHUNK_FRAMES: usize = 16 * LANES;
/// Below this many values, other threads cost more than they give.
const PARALLEL_VALUES: usize = 1 << 15;

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
    run_with(plan, &direct::find(plan, clip.joints()), clip, control)
}

/// Outputs without an entry in `direct` take the loop over frames.
fn run_with(plan: &Plan, direct: &[Option<Direct>], clip: &Clip, control: &Control) -> Result<Clip, RunError> {
    let active = Active::new(plan, direct);
    let mut joints = vec![JointTracks::default(); plan.target_joint_count];
    let found_directly = fill_directly(plan, direct, clip, control, &mut joints)?;
    let found_by_frame = loop_over_frames(plan, &active, clip, control, &mut joints)?;
    let (name, times) = (clip.name().to_owned(), clip.times_seconds().to_vec());
    let is_finite = found_directly && found_by_frame;
    Ok(if is_finite { Clip::of_checked(name, times, joints) } else { Clip::new(name, times, joints)? })
}

/// Fills the tracks that follow from tracks of the source, and says whether they are finite.
fn fill_directly(
    plan: &Plan,
    direct: &[Option<Direct>],
    clip: &Clip,
    control: &Control,
    joints: &mut [JointTracks],
) -> Result<bool, Canceled> {
    let frames = clip.frame_count();
    let found: Vec<(usize, &Direct)> =
        plan.outputs.iter().zip(direct).filter_map(|(output, direct)| Some((output.joint, direct.as_ref()?))).collect();
    let fill = |(joint, direct): &(usize, &Direct)| Ok((*joint, direct.fill(clip.joints(), frames, control)?));
    let filled: Vec<(usize, Filled)> = if found.len() * frames < PARALLEL_VALUES {
        found.iter().map(fill).collect::<Result<_, Canceled>>()?
    } else {
        found.par_iter().map(fill).collect::<Result<_, Canceled>>()?
    };
    let mut is_finite = true;
    for (joint, filled) in filled {
        is_finite &= filled.is_finite;
        joints[joint] = filled.tracks;
    }
    Ok(is_finite)
}

/// Fills the tracks that need poses, and says whether they are finite.
fn loop_over_frames(
    plan: &Plan,
    active: &Active,
    clip: &Clip,
    control: &Control,
    joints: &mut [JointTracks],
) -> Result<bool, Canceled> {
    let frames = clip.frame_count();
    if active.outputs.is_empty() {
        control.advance(frames as u64);
        return Ok(true);
    }
    let mut results: Vec<ResultTracks> =
        active.outputs.par_iter().map(|output| ResultTracks::new(frames, output.translation, output.scale)).collect();
    let chunks = split_into_chunks(&mut results, frames);
    let fill = |workspace: &mut Workspace, mut chunk: Chunk<'_>| {
        control.check()?;
        workspace.run(plan, active, clip.joints(), &mut chunk);
        control.advance(chunk.frames as u64);
        Ok::<bool, Canceled>(chunk.tracks.iter().all(|tracks| tracks.is_finite))
    };
    let is_finite = chunks
        .into_par_iter()
        .map_init(|| Workspace::new(plan), fill)
        .try_reduce(|| true, |before, chunk| Ok(before && chunk))?;
    results.par_iter_mut().for_each(|tracks| join_hemispheres(&mut tracks.rotations));
    for (output, result) in active.outputs.iter().zip(results) {
        joints[output.joint] = result.into_tracks(output);
    }
    Ok(is_finite)
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

    fn into_tracks(self, output: &Output) -> JointTracks {
        JointTracks {
            rotation: Track::Sampled(self.rotations),
            translation: if output.translation { Track::Sampled(self.translations) } else { Track::Rest },
            scale: if output.scale { Track::Sampled(self.scales) } else { Track::Rest },
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

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::{
        model::{Joint, Reporter, Scene, Skeleton},
        retarget::{resolve::resolve, spec::parse_spec},
        rig::Rig,
        samples,
    };

    fn compiled(spec: &[u8], source: &Scene, target: &Scene, clip: &Clip) -> Plan {
        let spec = parse_spec(spec).expect("a spec");
        let mut reporter = Reporter::new();
        let source = Rig::new("source", source, None, &spec.source, &mut reporter).expect("a rig");
        let target = Rig::new("target", target, None, &spec.target, &mut reporter).expect("a rig");
        let resolved = resolve(&spec, &source, &target, clip, &mut reporter).expect("it maps");
        Plan::new(source.skeleton(), target.skeleton(), &resolved.mapping)
    }

    #[test]
    fn what_no_track_can_hold_is_told_with_its_frame() {
        let (source, target) = (samples::walk_scene(), samples::mannequin_scene());
        let far = source.clips[0].frame_count() - 1;
        let mut joints = source.clips[0].joints().to_vec();
        let Track::Sampled(places) = &mut joints[0].translation else { panic!("the walk travels") };
        places[far] = Vec3::X * 3e38;
        let clip = source.clips[0].clone().with_joints(joints).expect("it is finite");
        let spec = br#"{"ops": [{"op": "pelvis", "scale": 2.0}, {"op": "fk"}]}"#;
        let plan = compiled(spec, &source, &target, &clip);
        let error = run(&plan, &clip, &Control::new()).expect_err("twice as far is too far");
        assert!(
            matches!(error, RunError::OutOfRange(ClipError::NotFinite { frame, .. }) if frame == far),
            "{error} at frame {far}"
        );
    }

    /// The walk with noise on every joint, so that all turn; a tenth of the values are not of unit length or on the other hemisphere.
    fn noisy(scene: &Scene, frames: usize, untidy: bool) -> Clip {
        let mut state = 1_u32;
        let mut random = move || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 24) - 0.5
        };
        let tracks = scene.skeleton.joints().iter().enumerate().map(|(index, joint)| {
            let (pace, way) = (0.02 + 0.01 * random(), DVec3::new(random(), random(), random()));
            let rotations = (0..frames).map(|frame| {
                let turn = DQuat::from_scaled_axis(way * (frame as f64 * pace).sin() * 3.0);
                let rotation = (joint.rest.rotation * turn).normalize();
                let factor = match random() {
                    below if untidy && below < -0.45 => -1.0,
                    above if untidy && above > 0.45 => 1.0 + 1e-4,
                    _ => 1.0,
                };
                (rotation * factor).as_quat()
            });
            let mut tracks = JointTracks { rotation: Track::Sampled(rotations.collect()), ..JointTracks::default() };
            if index == 0 {
                let place = |frame: usize| (joint.rest.translation + way * (frame as f64 * 0.01)).as_vec3();
                tracks.translation = Track::Sampled((0..frames).map(place).collect());
            }
            tracks
        });
        let times = (0..frames).map(|frame| frame as f64 / 30.0).collect();
        Clip::new("noise".into(), times, tracks.collect()).expect("a clip")
    }

    /// The same skeleton a tenth larger.
    fn larger(scene: &Scene) -> Scene {
        let joints = scene.skeleton.joints().iter().map(|joint| {
            let rest = crate::model::Transform { translation: joint.rest.translation * 1.1, ..joint.rest };
            Joint { rest, ..joint.clone() }
        });
        Scene { skeleton: Skeleton::new(joints.collect()).expect("the same order"), clips: Vec::new(), ..scene.clone() }
    }

    /// How many outputs were found directly.
    fn assert_direct_is_as_by_frame(spec: &[u8], source: &Scene, target: &Scene, clip: &Clip) -> usize {
        let plan = compiled(spec, source, target, clip);
        let direct = direct::find(&plan, clip.joints());
        let by_frame: Vec<Option<Direct>> = direct.iter().map(|_| None).collect();
        let (ours, theirs) = (
            run_with(&plan, &direct, clip, &Control::new()).expect("it runs"),
            run_with(&plan, &by_frame, clip, &Control::new()).expect("it runs"),
        );
        for (joint, (ours, theirs)) in ours.joints().iter().zip(theirs.joints()).enumerate() {
            let (Track::Sampled(one), Track::Sampled(other)) = (&ours.rotation, &theirs.rotation) else {
                assert_eq!(ours, theirs, "joint {joint} is still");
                continue;
            };
            for (frame, (one, other)) in one.iter().zip(other).enumerate() {
                // The loop brings lengths to one, in double precision; a map keeps those of the source, which are one but for
                // rounding.
                let (one, other) = (one.as_dquat(), other.as_dquat());
                assert!((one.length() - 1.0).abs() < 5e-7, "joint {joint}, frame {frame}: {one}");
                let apart = (one.normalize() - other.normalize()).length();
                assert!(2.0 * apart.to_degrees() < 1e-5, "joint {joint}, frame {frame}: {one} and {other}");
            }
            let places = |track: &Track<Vec3>| -> Vec<Vec3> {
                (0..clip.frame_count()).map(|frame| track.at(frame, Vec3::ZERO)).collect()
            };
            for (one, other) in places(&ours.translation).iter().zip(places(&theirs.translation)) {
                assert!(one.distance(other) <= 2e-7 * (1.0 + other.length()), "joint {joint}: {one} and {other}");
            }
            assert_eq!(ours.scale, theirs.scale, "joint {joint}");
        }
        direct.iter().flatten().count()
    }

    const DEFAULT: &[u8] = br#"{"ops": [{"op": "pelvis"}, {"op": "fk"}]}"#;

    #[test]
    fn tracks_that_follow_directly_are_those_of_the_loop_over_frames() {
        let walk = samples::walk_scene();
        for (untidy, frames) in [(false, 1), (false, 700), (true, 700), (false, 128), (true, 129)] {
            let clip = noisy(&walk, frames, untidy);
            let like = assert_direct_is_as_by_frame(DEFAULT, &walk, &larger(&walk), &clip);
            assert!(like > 55, "{like} joints of two like skeletons follow directly");
            let other = assert_direct_is_as_by_frame(DEFAULT, &walk, &samples::mannequin_scene(), &clip);
            assert!(other > 20, "{other} joints of the mannequin follow directly");
        }
        assert_direct_is_as_by_frame(DEFAULT, &walk, &samples::mannequin_scene(), &walk.clips[0]);
    }

    #[test]
    fn what_shares_alphas_and_translations_is_that_of_the_loop_over_frames() {
        let walk = samples::walk_scene();
        let clip = noisy(&walk, 200, false);
        let specs: [&[u8]; 3] = [
            br#"{"ops": [{"op": "pelvis", "rotation_alpha": 0.5, "translation_alpha": 0.7}, {"op": "fk"}]}"#,
            br#"{"ops": [{"op": "pelvis"}, {"op": "fk", "rotation_alpha": 0.5, "mask": ["left_arm"]}]}"#,
            br#"{"ops": [{"op": "pelvis"}, {"op": "fk", "translation": "globally_scaled"}]}"#,
        ];
        for spec in specs {
            for target in [larger(&walk), samples::mannequin_scene()] {
                assert_direct_is_as_by_frame(spec, &walk, &target, &clip);
            }
        }
    }

    #[test]
    fn rotations_of_joints_that_nothing_follows_are_multiplied_in() {
        // Each joint of the source is split in two, of which both turn; the target has the joints of before.
        let walk = samples::walk_scene();
        let joints = walk.skeleton.joints().iter().enumerate().flat_map(|(index, joint)| {
            let half = Joint {
                parent: joint.parent.map(|parent| 2 * parent + 1),
                name: format!("{}_offset", joint.name),
                ..joint.clone()
            };
            let whole = Joint { parent: Some(2 * index), rest: crate::model::Transform::IDENTITY, ..joint.clone() };
            [half, whole]
        });
        let split = Scene {
            skeleton: Skeleton::new(joints.collect()).expect("parents first"),
            clips: Vec::new(),
            ..walk.clone()
        };
        let clip = noisy(&split, 150, false);
        let found = assert_direct_is_as_by_frame(DEFAULT, &split, &larger(&walk), &clip);
        assert!(found > 15, "{found} joints follow directly");
    }
}
