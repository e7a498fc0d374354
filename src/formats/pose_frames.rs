//! Frames of a skeleton as dense arrays, in and out, without a file around them: for callers that hold arrays already.
//!
//! The joints are those that pose arrays have as a file, in the same order, axes and unit.

use std::ops::Range;

use glam::{Quat, Vec3};
use rayon::prelude::*;

use super::{space::Conversion, written::joints_to_write};
use crate::model::{Axes, Clip, ClipError, JointTracks, Scene, Track};

/// Frames that one thread writes at a time.
const CHUNK_FRAMES: usize = 64;
/// One thread reads the tracks of at least so many joints: values of neighbors share cache lines.
const LEAST_JOINTS: usize = 8;

/// Local values of all joints at all frames, each frame after frame and in it joint after joint.
#[derive(Clone, Copy, Debug)]
pub struct FrameArrays<'a> {
    /// 3 numbers a joint; nothing where translations stay at rest.
    pub translations: Option<&'a [f32]>,
    /// 4 numbers a joint, `x y z w`.
    pub rotations: &'a [f32],
    /// 3 numbers a joint; nothing where scales stay at rest.
    pub scales: Option<&'a [f32]>,
}

/// The same, to be filled.
#[derive(Debug)]
pub struct FrameArraysMut<'a> {
    /// 3 numbers a joint.
    pub translations: &'a mut [f32],
    /// 4 numbers a joint, `x y z w`.
    pub rotations: &'a mut [f32],
    /// 3 numbers a joint.
    pub scales: &'a mut [f32],
}

/// One joint of the arrays.
#[derive(Clone, Debug)]
struct ArrayJoint {
    name: String,
    /// Its index in the skeleton.
    joint: usize,
    /// The joint above it in the arrays.
    parent: Option<usize>,
    /// At rest, in the scene's space.
    rest: (Vec3, Quat, Vec3),
}

/// How frames of one skeleton lie in arrays.
#[derive(Clone, Debug)]
pub struct PoseFrames {
    joints: Vec<ArrayJoint>,
    skeleton_joints: usize,
    /// From the scene's space to that of the arrays; nothing where they are the same.
    arrays_from_scene: Option<Conversion>,
    axes: Axes,
    unit_meters: f64,
}

impl PoseFrames {
    /// Those of a scene, with the axes and unit that it was found to have. A scene that says its own is left in them.
    #[must_use]
    pub fn of(scene: &Scene, (axes, unit_meters): (Axes, f64)) -> Self {
        let skeleton = &scene.skeleton;
        let written = joints_to_write(skeleton);
        let joints = written.iter().map(|index| {
            let joint = &skeleton.joints()[*index];
            let (translation, scale) = (joint.rest.translation.as_vec3(), joint.rest.scale.as_vec3());
            ArrayJoint {
                name: joint.name.clone(),
                joint: *index,
                parent: joint.parent.and_then(|parent| written.binary_search(&parent).ok()),
                rest: (translation, joint.rest.rotation.as_quat(), scale),
            }
        });
        let (axes, unit_meters, arrays_from_scene) = match (scene.axes, scene.unit_meters) {
            (Some(axes), unit) => (axes, unit.unwrap_or(1.0), None),
            (None, _) => {
                let conversion = Conversion::into_ours(axes, unit_meters);
                (Axes::Y_UP_Z_FRONT, 1.0, (!conversion.is_identity()).then_some(conversion))
            }
        };
        Self { joints: joints.collect(), skeleton_joints: skeleton.len(), arrays_from_scene, axes, unit_meters }
    }

    /// How many joints the arrays have.
    #[must_use]
    pub const fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// The names of the joints.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.joints.iter().map(|joint| joint.name.as_str())
    }

    /// Each joint's parent in the arrays; parents come first.
    pub fn parents(&self) -> impl Iterator<Item = Option<usize>> {
        self.joints.iter().map(|joint| joint.parent)
    }

    /// Each joint at rest: translation, rotation and scale, local.
    pub fn rests(&self) -> impl Iterator<Item = (Vec3, Quat, Vec3)> {
        self.joints.iter().map(|joint| {
            let (translation, rotation, scale) = joint.rest;
            let rotation = self.rotation(joint, rotation);
            (Vec3::from_array(self.translation(joint, translation)), Quat::from_array(rotation), scale)
        })
    }

    /// Axes and meters per unit of the arrays.
    #[must_use]
    pub const fn space(&self) -> (Axes, f64) {
        (self.axes, self.unit_meters)
    }

    /// A clip of the skeleton. The arrays have as many frames as there are times, and all joints; what is longer is left out, what is
    /// shorter has no clip.
    ///
    /// # Errors
    /// When times do not rise, an array is too short, or a value is not finite.
    pub fn clip(&self, name: &str, times_seconds: Vec<f64>, arrays: &FrameArrays<'_>) -> Result<Clip, ClipError> {
        let frames = times_seconds.len();
        // As few groups as there are threads, since memory is read best in one piece.
        let width = self.joints.len().div_ceil(rayon::current_num_threads()).max(LEAST_JOINTS);
        let groups = self.joints.par_chunks(width).enumerate();
        let made = groups.flat_map_iter(|(group, joints)| self.tracks(group * width, joints, frames, arrays));
        let mut joints = vec![JointTracks::default(); self.skeleton_joints];
        for (joint, tracks) in made.collect::<Vec<_>>() {
            joints[joint] = tracks;
        }
        Clip::new(name.to_owned(), times_seconds, joints)
    }

    /// The tracks of neighboring joints, the first of which has the place `first` in the arrays.
    fn tracks(
        &self,
        first: usize,
        joints: &[ArrayJoint],
        frames: usize,
        arrays: &FrameArrays<'_>,
    ) -> Vec<(usize, JointTracks)> {
        let inverse = self.arrays_from_scene.map(|conversion| conversion.inverse());
        let block = Block { first, joints: joints.len(), all_joints: self.joints.len(), frames };
        let translations = block.columns(arrays.translations, |joint, value| {
            let value = Vec3::from_array(value);
            inverse.map_or(value, |inverse| inverse.place(value, joints[joint].parent.is_none()))
        });
        let rotations = block.columns(Some(arrays.rotations), |joint, value| {
            let value = unit(Quat::from_array(value));
            inverse.map_or(value, |inverse| inverse.turn(value, joints[joint].parent.is_none()))
        });
        let scales = block.columns(arrays.scales, |_, value| Vec3::from_array(value));
        let tracks = joints.iter().zip(translations).zip(rotations).zip(scales);
        let of_joint = |(((joint, translation), rotation), scale): (((&ArrayJoint, _), Track<Quat>), _)| {
            (joint.joint, JointTracks { translation, rotation: rotation.on_one_hemisphere(), scale })
        };
        tracks.map(of_joint).collect()
    }

    /// Fills arrays with a clip of the skeleton, as many frames as they have room for.
    pub fn fill(&self, clip: &Clip, arrays: FrameArraysMut<'_>) {
        let count = self.joints.len();
        let tracks = |joint: &ArrayJoint| &clip.joints()[joint.joint];
        let translations = Rows::of(
            self,
            |joint| (&tracks(joint).translation, joint.rest.0),
            |joint, value| self.translation(joint, value),
        );
        let rotations =
            Rows::of(self, |joint| (&tracks(joint).rotation, joint.rest.1), |joint, value| self.rotation(joint, value));
        let scales = Rows::of(self, |joint| (&tracks(joint).scale, joint.rest.2), |_, value| value.to_array());
        let of_translations = arrays.translations.par_chunks_mut((CHUNK_FRAMES * count * 3).max(1));
        let of_rotations = arrays.rotations.par_chunks_mut((CHUNK_FRAMES * count * 4).max(1));
        let of_scales = arrays.scales.par_chunks_mut((CHUNK_FRAMES * count * 3).max(1));
        let chunks = of_translations.zip(of_rotations).zip(of_scales).enumerate();
        chunks.for_each(|(chunk, ((of_translations, of_rotations), of_scales))| {
            let [first, after] = [chunk, chunk + 1].map(|chunk| clip.frame_count().min(chunk * CHUNK_FRAMES));
            let frames = first..after;
            translations.fill(of_translations, frames.clone());
            rotations.fill(of_rotations, frames.clone());
            scales.fill(of_scales, frames);
        });
    }

    /// A local translation in the space of the arrays.
    fn translation(&self, joint: &ArrayJoint, value: Vec3) -> [f32; 3] {
        let place = |conversion: Conversion| conversion.place(value, joint.parent.is_none());
        self.arrays_from_scene.map_or(value, place).to_array()
    }

    /// A local rotation likewise.
    fn rotation(&self, joint: &ArrayJoint, value: Quat) -> [f32; 4] {
        let turn = |conversion: Conversion| conversion.turn(value, joint.parent.is_none());
        unit(self.arrays_from_scene.map_or(value, turn)).to_array()
    }
}

/// One channel of a clip, as rows of arrays with a value for every joint.
struct Rows<'a, const WIDTH: usize, T, F> {
    /// What all frames have of joints that do not move.
    still: Vec<[f32; WIDTH]>,
    /// The others: the place of each in a row, and its values frame by frame.
    moving: Vec<(usize, &'a ArrayJoint, &'a [T])>,
    value: F,
}

impl<'a, const WIDTH: usize, T: Copy + 'a, F: Fn(&ArrayJoint, T) -> [f32; WIDTH]> Rows<'a, WIDTH, T, F> {
    /// `track` gives the track of a joint and its value at rest, `value` what the arrays have of it.
    fn of(frames: &'a PoseFrames, track: impl Fn(&ArrayJoint) -> (&'a Track<T>, T), value: F) -> Self {
        let (mut still, mut moving) = (Vec::with_capacity(frames.joints.len()), Vec::new());
        for (place, joint) in frames.joints.iter().enumerate() {
            let (track, rest) = track(joint);
            let first = match track {
                Track::Rest => rest,
                Track::Constant(constant) => *constant,
                Track::Sampled(samples) => {
                    moving.push((place, joint, samples.as_slice()));
                    rest
                }
            };
            still.push(value(joint, first));
        }
        Self { still, moving, value }
    }

    /// Fills the rows of some frames, as many as there is room for.
    fn fill(&self, rows: &mut [f32], frames: Range<usize>) {
        let (values, _) = rows.as_chunks_mut();
        let width = self.still.len().max(1);
        values.chunks_exact_mut(width).take(frames.len()).for_each(|row| row.copy_from_slice(&self.still));
        for (place, joint, samples) in &self.moving {
            let places = values.iter_mut().skip(*place).step_by(width);
            for (value, sample) in places.zip(&samples[frames.clone()]) {
                *value = (self.value)(joint, *sample);
            }
        }
    }
}

/// Neighboring joints of arrays, at all frames.
struct Block {
    first: usize,
    joints: usize,
    all_joints: usize,
    frames: usize,
}

impl Block {
    /// A track for each joint. The values of a frame lie beside one another, so all joints take theirs before the next frame is looked at.
    fn columns<const WIDTH: usize, T: Copy>(
        &self,
        values: Option<&[f32]>,
        change: impl Fn(usize, [f32; WIDTH]) -> T,
    ) -> Vec<Track<T>> {
        let Some(values) = values else { return (0..self.joints).map(|_| Track::Rest).collect() };
        let rows = values.chunks((self.all_joints * WIDTH).max(1)).take(self.frames).map(|frame| {
            let (row, _) = frame.get(self.first * WIDTH..).unwrap_or_default().as_chunks::<WIDTH>();
            &row[..self.joints.min(row.len())]
        });
        let Some(first) = rows.clone().next() else {
            return (0..self.joints).map(|_| Track::Sampled(Vec::new())).collect();
        };
        // Most rigs turn their joints and neither move nor scale them.
        let mut changes = vec![[0; WIDTH]; first.len()];
        for row in rows.clone() {
            let values = changes.as_flattened_mut().iter_mut().zip(row.as_flattened()).zip(first.as_flattened());
            values.for_each(|((change, value), first)| *change |= value.to_bits() ^ first.to_bits());
        }
        let is_whole = values.len() >= self.frames * self.all_joints * WIDTH;
        let is_still = |joint: usize| is_whole && changes.get(joint).is_some_and(|change| *change == [0; WIDTH]);
        let moving: Vec<usize> = (0..self.joints).filter(|joint| !is_still(*joint)).collect();
        let mut columns: Vec<Vec<T>> = moving.iter().map(|_| Vec::with_capacity(self.frames)).collect();
        for row in rows {
            for (column, joint) in columns.iter_mut().zip(&moving) {
                column.extend(row.get(*joint).map(|value| change(*joint, *value)));
            }
        }
        let mut tracks: Vec<Track<T>> =
            first.iter().enumerate().map(|(joint, value)| Track::Constant(change(joint, *value))).collect();
        tracks.resize(self.joints, Track::Rest);
        for (joint, column) in moving.into_iter().zip(columns) {
            tracks[joint] = Track::Sampled(column);
        }
        tracks
    }
}

/// What is a unit quaternion but for rounding keeps its bits. One of no length has no direction, and stays what no clip takes.
fn unit(rotation: Quat) -> Quat {
    if (rotation.length_squared() - 1.0).abs() < 2e-5 { rotation } else { rotation / rotation.length() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples;

    fn arrays_of(frames: &PoseFrames, clip: &Clip) -> [Vec<f32>; 3] {
        let values = clip.frame_count() * frames.joint_count();
        let mut arrays = [vec![0.0; values * 3], vec![0.0; values * 4], vec![0.0; values * 3]];
        let [translations, rotations, scales] = &mut arrays;
        frames.fill(clip, FrameArraysMut { translations, rotations, scales });
        arrays
    }

    #[test]
    fn a_clip_goes_through_arrays_as_it_is() {
        let scene = samples::walk_scene();
        let clip = &scene.clips[0];
        for space in [(Axes::Y_UP_Z_FRONT, 1.0), (Axes::Z_UP_Y_FRONT, 0.01)] {
            // One that does not say what space it is in, as BVH.
            let silent = Scene { axes: None, unit_meters: None, ..scene.clone() };
            let frames = PoseFrames::of(&silent, space);
            let [translations, rotations, scales] = arrays_of(&frames, clip);
            let given = FrameArrays { translations: Some(&translations), rotations: &rotations, scales: Some(&scales) };
            let times = clip.times_seconds().to_vec();
            let back = frames.clip("walk", times, &given).expect("finite");
            for frame in [0, 60, 120] {
                let (one, other) = (clip.local_pose(&scene.skeleton, frame), back.local_pose(&scene.skeleton, frame));
                for (one, other) in
                    one.to_model(&scene.skeleton).transforms().iter().zip(other.to_model(&scene.skeleton).transforms())
                {
                    assert!((one.translation - other.translation).length() < 1e-5, "{one:?} {other:?}");
                    assert!(one.rotation.dot(other.rotation).abs() > 1.0 - 1e-6, "{one:?} {other:?}");
                }
            }
        }
    }

    #[test]
    fn room_for_more_frames_or_fewer_stays_as_it_is_or_is_filled() {
        let scene = samples::walk_scene();
        let (clip, frames) = (&scene.clips[0], PoseFrames::of(&scene, (Axes::Y_UP_Z_FRONT, 1.0)));
        let whole = arrays_of(&frames, clip);
        for room in [3 * CHUNK_FRAMES + 1, CHUNK_FRAMES + 1, 0] {
            let values = room * frames.joint_count();
            let mut arrays = [vec![7.0; values * 3], vec![7.0; values * 4], vec![7.0; values * 3]];
            let [translations, rotations, scales] = &mut arrays;
            frames.fill(clip, FrameArraysMut { translations, rotations, scales });
            for (filled, whole) in arrays.iter().zip(&whole) {
                let both = filled.len().min(whole.len());
                assert_eq!(filled[..both], whole[..both], "room for {room} frames");
                assert!(filled[both..].iter().all(|value| *value == 7.0), "beyond the clip");
            }
        }
    }

    #[test]
    fn arrays_that_are_no_poses_give_no_clip() {
        let scene = samples::walk_scene();
        let frames = PoseFrames::of(&scene, (Axes::Y_UP_Z_FRONT, 1.0));
        let count = frames.joint_count();
        let still = |rotations: &[f32]| {
            frames.clip("", vec![0.0, 1.0], &FrameArrays { translations: None, rotations, scales: None })
        };
        let identity: Vec<f32> = (0..2 * count).flat_map(|_| [0.0, 0.0, 0.0, 1.0]).collect();
        assert!(still(&identity).is_ok(), "two frames at rest");
        assert!(matches!(still(&identity[4..]), Err(ClipError::TrackLength { .. })), "a joint is missing");
        assert!(matches!(still(&vec![0.0; identity.len()]), Err(ClipError::NotFinite { .. })), "no rotations at all");
    }
}
