//! Swapping left and right by components of local rotations: no more than a rig of a certain make allows.
//!
//! With the rest pose taken out of local rotations, Δ = B⁻¹ · L, a joint of a side gets its twin's Δ as it is, and a joint of the middle
//! has all components of Δ negated but the one about its own sideways axis; translations likewise, of twins below twins all three
//! negated. That mirrors poses where twins turn the same way about their own axes (a bone's axes on the right are those on the left,
//! mirrored and then reversed) and joints of the middle have an axis that points sideways. On such rigs it is what [`super::Mirror`]
//! does; on others it is not.

use glam::{DQuat, DVec3, Quat, Vec3};

use crate::{
    model::{Clip, ClipError, JointTracks, Skeleton, Transform},
    retarget::{ComponentAxis, MirrorAxis},
    rig::Rig,
};

use super::Mirror;

/// Mirrors a clip by components.
///
/// `center` is the sideways axis of joints of the middle, `pelvis` that of the pelvis and all above; where they are not given, the axis
/// that points sideways most at rest is taken, joint by joint. An axis for translations alone is one of the parent's space.
///
/// # Errors
/// When the result does not fit into the numbers of a track.
pub fn mirror_components(
    rig: &Rig<'_>,
    mirror: &Mirror<'_>,
    clip: &Clip,
    center: Option<MirrorAxis>,
    pelvis: Option<MirrorAxis>,
) -> Result<Clip, ClipError> {
    let skeleton = rig.skeleton();
    let twins = mirror.twins();
    let pelvis_joint = rig.role("pelvis").first().copied();
    let given = |joint: usize| {
        let is_pelvis = pelvis_joint.is_some_and(|pelvis| skeleton.is_ancestor_or_self(joint, pelvis));
        if is_pelvis { pelvis.or(center) } else { center }
    };
    let rest = mirror.rest().transforms();
    let axis_of = |joint: usize| {
        let given = given(joint).and_then(MirrorAxis::rotation);
        given.map_or_else(|| sideways(rest[joint].rotation, mirror.lateral()), ComponentAxis::vector)
    };
    let joints = (0..skeleton.len()).map(|joint| {
        let twin = twins.of(joint);
        let (own, other) = (local_rest(rest, skeleton, joint), local_rest(rest, skeleton, twin));
        let tracks = &clip.joints()[twin];
        let is_center = twin == joint;
        let own_axis = axis_of(joint);
        let turn = |value: Quat| {
            let change = other.0.conjugate() * value.as_dquat();
            let change = if is_center { about(change, own_axis) } else { change };
            (own.0 * change).normalize().as_quat()
        };
        // A translation lies in the parent's axes.
        let parent = skeleton.parent(joint);
        let is_below_center = parent.is_none_or(|parent| twins.of(parent) == parent);
        let own_translation = given(joint).and_then(MirrorAxis::translation).map(ComponentAxis::vector);
        let parent_axis = own_translation.unwrap_or_else(|| parent.map_or_else(|| mirror.lateral(), axis_of));
        let place = |value: Vec3| {
            let change = value.as_dvec3() - other.1;
            let change = if is_below_center { change - parent_axis * (2.0 * change.dot(parent_axis)) } else { -change };
            (own.1 + change).as_vec3()
        };
        JointTracks {
            translation: tracks.translation.map(place),
            rotation: tracks.rotation.map(turn),
            scale: tracks.scale.clone(),
        }
    });
    mirror.with_other_sides(clip, joints.collect())
}

/// Local rotation and translation at rest.
fn local_rest(rest: &[Transform], skeleton: &Skeleton, joint: usize) -> (DQuat, DVec3) {
    let local = skeleton.parent(joint).map_or(rest[joint], |parent| rest[parent].relative(&rest[joint]));
    (local.rotation, local.translation)
}

/// The own axis of a joint that lies sideways most.
fn sideways(rotation: DQuat, lateral: DVec3) -> DVec3 {
    let lateral = (rotation.conjugate() * lateral).abs();
    if lateral.x >= lateral.y && lateral.x >= lateral.z {
        DVec3::X
    } else if lateral.y >= lateral.z {
        DVec3::Y
    } else {
        DVec3::Z
    }
}

/// The rotation with all components negated but the real one and that about an axis.
fn about(rotation: DQuat, axis: DVec3) -> DQuat {
    let vector = DVec3::new(rotation.x, rotation.y, rotation.z);
    let kept = axis * (2.0 * vector.dot(axis)) - vector;
    DQuat::from_xyzw(kept.x, kept.y, kept.z, rotation.w)
}
