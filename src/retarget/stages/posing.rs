//! Where a few joints of a skeleton are at one frame.

use glam::{Quat, Vec3};

use super::ahead::{Ahead, FRAMES, PosedJoint, unit};
use crate::model::{JointTracks, Skeleton, Transform};

/// The joints that a stage looks at, with everything above them, parents first.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Posing {
    joints: Vec<PosedJoint>,
    slots: Vec<Option<usize>>,
    /// `plan_from_scene`: what the roots hang below.
    above: Transform,
}

/// The transforms of a [`Posing`]'s joints at one frame, by slot. Filled again and again without allocation, always from the same
/// tracks: those of further frames are found ahead.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Pose {
    /// `parent_from_joint`.
    pub(in crate::retarget) local: Vec<Transform>,
    /// `plan_from_joint`.
    pub(in crate::retarget) model: Vec<Transform>,
    ahead: Ahead,
}

impl Posing {
    pub(in crate::retarget) fn new(
        skeleton: &Skeleton,
        above: Transform,
        wanted: impl IntoIterator<Item = usize>,
    ) -> Self {
        let mut posing = Self { joints: Vec::new(), slots: vec![None; skeleton.len()], above };
        for joint in skeleton.with_ancestors(wanted) {
            posing.slots[joint] = Some(posing.joints.len());
            let parent = skeleton.parent(joint).and_then(|parent| posing.slots[parent]);
            posing.joints.push(PosedJoint { joint, parent, rest: skeleton.joints()[joint].rest });
        }
        posing
    }

    /// Whether a joint is looked at.
    pub(in crate::retarget) fn has(&self, joint: usize) -> bool {
        self.slots[joint].is_some()
    }

    /// The local rotation of a joint that was wanted, at rest.
    pub(in crate::retarget) fn rest_rotation(&self, joint: usize) -> Quat {
        self.joints[self.slot(joint)].rest.rotation.as_quat()
    }

    /// The slot of a joint that was wanted, or is above one.
    pub(in crate::retarget) fn slot(&self, joint: usize) -> usize {
        self.slots[joint].expect("a stage asks for the joints that it wanted")
    }

    /// The joint of a slot.
    pub(in crate::retarget) fn joint(&self, slot: usize) -> usize {
        self.joints[slot].joint
    }

    /// A pose to be filled.
    pub(in crate::retarget) fn pose(&self) -> Pose {
        let identity = vec![Transform::IDENTITY; self.joints.len()];
        Pose { local: identity.clone(), model: identity, ahead: Ahead::new(&self.joints) }
    }

    /// Fills a pose from the tracks of all joints of the skeleton at a frame. The tracks are the same for as long as
    /// the pose is used.
    pub(in crate::retarget) fn fill(&self, pose: &mut Pose, tracks: &[JointTracks], frame: usize) {
        self.fill_some(pose, tracks, frame, self.joints.len());
    }

    /// The same, for who looks at where joints are in the model only: local transforms are of any frame then.
    pub(in crate::retarget) fn fill_model(&self, pose: &mut Pose, tracks: &[JointTracks], frame: usize) {
        self.fill_some(pose, tracks, frame, 0);
    }

    /// With the local transforms of the first so many joints.
    fn fill_some(&self, pose: &mut Pose, tracks: &[JointTracks], frame: usize, locals: usize) {
        let Pose { local, model, ahead } = pose;
        let local = &mut local[..locals];
        if ahead.take(frame, local, model) {
            return;
        }
        if frame.is_multiple_of(FRAMES) && self.has_frames(tracks, frame + FRAMES) {
            ahead.find(&self.joints, &self.above, tracks, frame);
            ahead.take(frame, local, model);
            return;
        }
        self.fill_one(pose, tracks, frame);
    }

    /// Whether there are so many frames.
    fn has_frames(&self, tracks: &[JointTracks], frames: usize) -> bool {
        let has = |count: Option<usize>| count.is_none_or(|count| count >= frames);
        self.joints.iter().map(|posed| &tracks[posed.joint]).all(|tracks| {
            has(tracks.translation.sample_count())
                && has(tracks.rotation.sample_count())
                && has(tracks.scale.sample_count())
        })
    }

    fn fill_one(&self, pose: &mut Pose, tracks: &[JointTracks], frame: usize) {
        for (slot, posed) in self.joints.iter().enumerate() {
            let tracks = &tracks[posed.joint];
            let mut local = posed.rest;
            if tracks.translation.is_animated() {
                local.translation = tracks.translation.at(frame, Vec3::ZERO).as_dvec3();
            }
            if tracks.rotation.is_animated() {
                local.rotation = unit(tracks.rotation.at(frame, Quat::IDENTITY).as_dquat());
            }
            if tracks.scale.is_animated() {
                local.scale = tracks.scale.at(frame, Vec3::ONE).as_dvec3();
            }
            pose.local[slot] = local;
            pose.model[slot] = self.parent_of(pose, slot).then_child(&local);
        }
    }

    /// The local rotation of a slot's joint at a frame, without filling a pose.
    pub(in crate::retarget) fn local_rotation(&self, slot: usize, tracks: &[JointTracks], frame: usize) -> Quat {
        let posed = &self.joints[slot];
        tracks[posed.joint].rotation.at(frame, posed.rest.rotation.as_quat())
    }

    /// The transform that a slot's joint hangs below.
    pub(in crate::retarget) fn parent_of(&self, pose: &Pose, slot: usize) -> Transform {
        self.joints[slot].parent.map_or(self.above, |parent| pose.model[parent])
    }
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, DVec3};

    use super::*;
    use crate::{model::Track, samples};

    #[test]
    fn poses_that_are_found_ahead_have_the_bits_of_single_ones() {
        let scene = samples::walk_scene();
        let mut tracks = scene.clips[0].joints().to_vec();
        let frames = scene.clips[0].frame_count();
        tracks[3].scale =
            Track::Sampled((0..frames).map(|frame| Vec3::new(1.0, 1.0 + frame as f32 * 0.01, 0.9)).collect());
        tracks[5].rotation = Track::Constant(Quat::from_xyzw(0.1, 0.2, 0.3, 0.927));
        let above = Transform {
            translation: DVec3::new(0.1, 2.0, -3.0),
            rotation: DQuat::from_rotation_y(0.4),
            scale: DVec3::new(0.5, 1.0, 2.0),
        };
        let posing = Posing::new(&scene.skeleton, above, 0..scene.skeleton.len());
        let (mut ahead, mut single, mut without_local) = (posing.pose(), posing.pose(), posing.pose());
        // Onward, again, back, and past the last whole run.
        for frame in (0..frames).chain([0, 0, 1, 17, 16, 18, 17, frames - 1]) {
            posing.fill(&mut ahead, &tracks, frame);
            posing.fill_one(&mut single, &tracks, frame);
            assert_eq!((&ahead.local, &ahead.model), (&single.local, &single.model), "frame {frame}");
            posing.fill_model(&mut without_local, &tracks, frame);
            assert_eq!(without_local.model, single.model, "frame {frame}");
            // Whoever gets a pose may change it.
            ahead.model[0].translation.x += 1.0;
            ahead.local[2].scale.x += 1.0;
        }
    }
}
