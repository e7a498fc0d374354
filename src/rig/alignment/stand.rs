//! How a turned body stands: its soles as high as at rest, and an animal on both pairs of its legs.

use glam::{DQuat, DVec3};

use crate::model::{ModelPose, Transform};

use super::super::{
    floor::{lowest_paw, lowest_sole},
    rig::Rig,
};

/// A trunk is sloped by no more than this; legs that are further from reaching the floor are held up.
const STEEPEST_DEGREES: f64 = 15.0;

/// The pose with its pelvis, and all below it, moved along the vertical until the soles are as high as at rest.
pub(super) fn regrounded(rig: &Rig<'_>, pose: ModelPose) -> ModelPose {
    let Some(&pelvis) = rig.role("pelvis").first() else { return pose };
    let (Some(before), Some(after)) = (lowest_sole(rig, &rig.rest, pelvis), lowest_sole(rig, &pose, pelvis)) else {
        return pose;
    };
    let shift = rig.up() * (before - after);
    let moved = pose.transforms().iter().enumerate().map(|(joint, transform)| {
        let is_below = rig.skeleton().is_ancestor_or_self(pelvis, joint);
        let translation = transform.translation + if is_below { shift } else { DVec3::ZERO };
        Transform { translation, ..*transform }
    });
    ModelPose::new(moved.collect())
}

/// By how much the trunk of a four-legged animal is to be turned, about the line of its hips, until its front paws are as high
/// above its hind paws as at rest; with the joint that it is turned at. Nothing for other rigs.
///
/// Legs that are turned to another animal's angles are of other lengths, and of others in front than behind.
pub(super) fn slope(rig: &Rig<'_>, pose: &ModelPose) -> Option<(usize, DQuat)> {
    let (&pelvis, &trunk) = (rig.role("pelvis").first()?, rig.role("spine").first()?);
    if !rig.stands_on_four() {
        return None;
    }
    let front_above_hind = |pose: &ModelPose| {
        Some(lowest_paw(rig, pose, pelvis, "front_leg")? - lowest_paw(rig, pose, pelvis, "hind_leg")?)
    };
    let rise = front_above_hind(&rig.rest)? - front_above_hind(pose)?;
    let place = |joint: usize| pose.transforms()[joint].translation;
    let (left, right) = (*rig.role("left_front_leg").first()?, *rig.role("right_front_leg").first()?);
    let shoulders = (place(left) + place(right)) / 2.0 - place(trunk);
    let up = rig.up();
    let axis = rig.canonical_from_scene.conjugate() * DVec3::X;
    let ahead = shoulders.dot(axis.cross(up));
    let length = ahead.hypot(shoulders.dot(up));
    let sine = (shoulders.dot(up) + rise) / length;
    if ahead <= 0.0 || !sine.is_finite() || sine.abs() > 1.0 {
        return None;
    }
    let most = STEEPEST_DEGREES.to_radians();
    let upward = (sine.asin() - shoulders.dot(up).atan2(ahead)).clamp(-most, most);
    // About its left, the body's front goes down.
    Some((trunk, DQuat::from_axis_angle(axis, -upward)))
}
