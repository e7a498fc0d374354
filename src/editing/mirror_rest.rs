//! The zero pose of a capture, put where its rest pose stands, to mirror about.

use glam::{DQuat, DVec3};

use crate::{
    model::{ModelPose, Transform},
    rig::{RestSource, Rig},
};

/// A bone is another one where the two poses have its joint apart by more than this share of its length.
const OTHER_BONE_SHARE: f64 = 0.02;

/// The pose of the file's nodes, moved and turned about the vertical so that its pelvis lies and its hips point as those of the rig's
/// rest pose do; nothing where that is the node pose already or somebody chose it, or where the two poses have other bones.
pub(super) fn zero_pose(rig: &Rig<'_>) -> Option<ModelPose> {
    if rig.rest_source != RestSource::StandingFrame {
        return None;
    }
    let skeleton = rig.skeleton();
    let zero = skeleton.rest_pose();
    let same_bones = skeleton.joints().iter().zip(zero.transforms().iter().zip(rig.rest_local.transforms()));
    let is_same = same_bones.filter(|(joint, _)| joint.parent.is_some()).all(|(_, (zero, rest))| {
        let length = zero.translation.length().max(rest.translation.length());
        zero.translation.distance(rest.translation) <= OTHER_BONE_SHARE * length
    });
    let pelvis = *rig.role("pelvis").first()?;
    let zero = zero.to_model(skeleton);
    let (from, to) = (across(rig, &zero)?, (rig.canonical_from_scene.conjugate() * DVec3::X).normalize());
    let turn = DQuat::from_axis_angle(rig.up(), from.cross(to).dot(rig.up()).atan2(from.dot(to)));
    let turned = turn * zero.transforms()[pelvis].translation;
    let placed = Transform {
        translation: rig.rest.transforms()[pelvis].translation - turned,
        rotation: turn,
        ..Transform::IDENTITY
    };
    let transforms = zero.transforms().iter().map(|transform| placed.then_child(transform)).collect();
    is_same.then(|| ModelPose::new(transforms))
}

/// From the right hip to the left in a pose, level; nothing where they stand on one another.
fn across(rig: &Rig<'_>, pose: &ModelPose) -> Option<DVec3> {
    let place = |role: &str| rig.role(role).first().map(|joint| pose.transforms()[*joint].translation);
    let apart = place("left_thigh")? - place("right_thigh")?;
    (apart - rig.up() * apart.dot(rig.up())).try_normalize()
}
