//! A clip of any skeleton as the humanoid that a VRM animation holds: its rest pose is a T pose in which no bone is turned.
//!
//! With `A` the rotation of a joint in model space in the T pose and `G` that in a frame, a bone turns by `N = W · G · A⁻¹ · W⁻¹` in the
//! axes of the format, where `W` turns the scene's axes into them; its own rotation is `Nₚ⁻¹ · N`. What joints between two bones
//! turn is in the lower bone. (VRMC_vrm_animation 1.0, "humanoid".)

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::model::{
    Axes, Canceled, Clip, Control, HumanoidBone, Joint, JointTracks, ModelPose, Morph, MorphTrack, Scene, Skeleton,
    Track, Transform,
};

use super::FormatError;

const FRAMES_PER_CHECK: usize = 64;

/// What is known of a humanoid before any frame.
#[derive(Debug)]
pub struct Humanoid<'a> {
    /// Of the scene.
    pub skeleton: &'a Skeleton,
    /// Its bones, the hips first.
    pub bones: &'a [HumanoidBone],
    /// The T pose, in model space of the scene.
    pub t_pose: ModelPose,
    /// Turns the scene's axes into +Y up and +Z front.
    pub canonical_from_scene: DQuat,
    /// Of the scene.
    pub unit_meters: f64,
    /// How far the T pose and the clip are raised, in meters, so that the floor is at zero.
    pub raised_meters: (f64, f64),
}

impl Humanoid<'_> {
    /// The bones as joints that are not turned, and what they do in the clip, in +Y up, +Z front and meters; with the rotation of what
    /// looks where the eyes do, and with expressions and their weights.
    ///
    /// # Errors
    /// When the work is canceled, or a value is not finite.
    pub fn animation(
        &self,
        clip: &Clip,
        gaze: Option<Track<Quat>>,
        (morphs, weights): (Vec<Morph>, Vec<MorphTrack>),
        control: &Control,
    ) -> Result<(Scene, Clip), FormatError> {
        let (mut joints, mut tracks) = (self.joints(), self.tracks(clip, control)?);
        let gaze_joint = gaze.map(|rotation| {
            let rest = Transform::IDENTITY;
            joints.push(Joint { name: "lookAt".into(), parent: None, rest, is_joint: false, node: joints.len() });
            tracks.push(JointTracks { rotation, ..JointTracks::default() });
            joints.len() - 1
        });
        let unusable = |error: &dyn std::fmt::Display| FormatError::malformed("humanoid", "", error.to_string());
        let scene = Scene {
            skeleton: Skeleton::new(joints).map_err(|error| unusable(&error))?,
            morphs,
            declared_roles: self.bones.iter().enumerate().map(|(index, bone)| (bone.name.clone(), index)).collect(),
            declared_convention: Some("vrma"),
            axes: Some(Axes::Y_UP_Z_FRONT),
            unit_meters: Some(1.0),
            gaze_joint,
            ..Scene::default()
        };
        let clip = Clip::new(clip.name().to_owned(), clip.times_seconds().to_vec(), tracks)
            .and_then(|clip| clip.with_morphs(weights))
            .map_err(|error| unusable(&error))?;
        Ok((scene, clip))
    }

    fn position(&self, pose: &ModelPose, bone: &HumanoidBone) -> DVec3 {
        self.canonical_from_scene * pose.transforms()[bone.joint].translation * self.unit_meters
    }

    fn joints(&self) -> Vec<Joint> {
        let position = |bone: &HumanoidBone| self.position(&self.t_pose, bone) + DVec3::Y * self.raised_meters.0;
        let joint = |(node, bone): (usize, &HumanoidBone)| {
            let parent = bone.parent.map_or(DVec3::ZERO, |parent| position(&self.bones[parent]));
            let rest = Transform::from_translation(position(bone) - parent);
            Joint { name: bone.name.clone(), parent: bone.parent, rest, is_joint: true, node }
        };
        self.bones.iter().enumerate().map(joint).collect()
    }

    fn tracks(&self, clip: &Clip, control: &Control) -> Result<Vec<JointTracks>, Canceled> {
        let frames = clip.frame_count();
        let (skeleton, work) = (self.skeleton, self.canonical_from_scene);
        let undo: Vec<DQuat> = self
            .bones
            .iter()
            .map(|bone| self.t_pose.transforms()[bone.turned_by].rotation.conjugate() * work.conjugate())
            .collect();
        let mut turns: Vec<Vec<Quat>> = vec![Vec::with_capacity(frames); self.bones.len()];
        let mut hips: Vec<Vec3> = Vec::with_capacity(frames);
        let mut turned = vec![DQuat::IDENTITY; self.bones.len()];
        for frame in 0..frames {
            if frame % FRAMES_PER_CHECK == 0 {
                control.check()?;
            }
            let pose = clip.local_pose(skeleton, frame).to_model(skeleton);
            for (index, bone) in self.bones.iter().enumerate() {
                turned[index] = work * pose.transforms()[bone.turned_by].rotation * undo[index];
                let above = bone.parent.map_or(DQuat::IDENTITY, |parent| turned[parent].conjugate());
                let turn = (above * turned[index]).normalize().as_quat();
                let is_far = turns[index].last().is_some_and(|before: &Quat| before.dot(turn) < 0.0);
                turns[index].push(if is_far { -turn } else { turn });
            }
            hips.push((self.position(&pose, &self.bones[0]) + DVec3::Y * self.raised_meters.1).as_vec3());
        }
        let rotation = |turns| JointTracks { rotation: Track::Sampled(turns).compacted(), ..JointTracks::default() };
        let mut tracks: Vec<JointTracks> = turns.into_iter().map(rotation).collect();
        tracks[0].translation = Track::Sampled(hips).compacted();
        Ok(tracks)
    }
}
