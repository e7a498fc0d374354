//! Clavicles of a target whose source has none: they lift as the arm is raised.
//!
//! A shoulder that stays where it is while the arm points at the sky looks like a doll's. Of what the upper arm is raised
//! beyond 30° from hanging, people's shoulder girdles do about a third (docs/algorithm/joints.md). The arm itself points where the
//! source's points all the same.

use crate::{
    retarget::mapping::{Mapping, ShoulderPair},
    rig::rig::Rig,
};

/// Arms are raised this far before shoulders follow.
const FREE_RADIANS: f64 = std::f64::consts::FRAC_PI_6;

/// Finds the clavicles that nothing of the source drives while their arms are driven.
pub(in crate::retarget) fn find_shoulders(
    source: &Rig<'_>,
    target: &Rig<'_>,
    mapping: &Mapping,
    share: f64,
) -> Vec<ShoulderPair> {
    let driven = mapping.driven();
    ["left_", "right_"].iter().filter_map(|side| find_shoulder(source, target, &driven, side, share)).collect()
}

fn find_shoulder(source: &Rig<'_>, target: &Rig<'_>, driven: &[bool], side: &str, share: f64) -> Option<ShoulderPair> {
    let first = |part: &str| target.role(&format!("{side}{part}")).first().copied();
    let (clavicle, upper_arm, forearm) = (first("clavicle")?, first("upper_arm")?, first("forearm")?);
    let parent = target.skeleton().parent(clavicle)?;
    let is_open = source.role(&format!("{side}clavicle")).is_empty() && !driven[clavicle] && driven[upper_arm];
    if !is_open || share == 0.0 || !target.skeleton().is_ancestor_or_self(clavicle, upper_arm) {
        return None;
    }
    let rest = target.rest.transforms();
    let direction = |from: usize, to: usize| (rest[to].translation - rest[from].translation).try_normalize();
    let (collar, along) = (direction(clavicle, upper_arm)?, direction(upper_arm, forearm)?);
    let up = target.up();
    let into_parent = rest[parent].rotation.conjugate();
    Some(ShoulderPair {
        joint: clavicle,
        upper_arm,
        arm: rest[upper_arm].rotation.conjugate() * along,
        up: into_parent * up,
        axis: into_parent * collar.cross(up).try_normalize()?,
        free_radians: along.angle_between(-up).max(FREE_RADIANS),
        share,
    })
}
