//! Scales, mirrorings and shear at rest.

use glam::{DQuat, DVec3};

use super::{FileFacts, Finding, FindingCode, places};
use crate::{
    model::{LocalPose, Transform},
    rig::Rig,
};

/// Scales closer to one another than this share are equal.
const EQUAL: f64 = 1e-3;
/// A factor below this leaves nothing.
const NOTHING: f64 = 1e-9;
/// How far a rotation may be from one that only swaps axes before a scale that differs by axis shears what it turns.
const TURNED_RADIANS: f64 = 1e-2;

pub(super) fn examine(rig: &Rig<'_>, facts: FileFacts<'_>, found: &mut Vec<Finding>) {
    let relevant = relevant_joints(rig);
    let scale = |joint: &usize| node(rig, *joint).scale;
    let joints = || relevant.iter().copied();

    let zero: Vec<usize> = joints().filter(|joint| scale(joint).abs().min_element() < NOTHING).collect();
    let sized = |joint: &usize| !zero.contains(joint);
    let negative: Vec<usize> = joints().filter(sized).filter(|joint| scale(joint).min_element() < 0.0).collect();
    let uneven: Vec<usize> = joints().filter(sized).filter(|joint| !is_even(scale(joint))).collect();
    let is_scaled = |joint: &usize| is_even(scale(joint)) && (scale(joint).abs().max_element() - 1.0).abs() > EQUAL;
    let scaled: Vec<usize> = joints().filter(sized).filter(is_scaled).collect();
    let (inside, above): (Vec<usize>, Vec<usize>) = scaled.into_iter().partition(|joint| is_in_skeleton(rig, *joint));

    let first = |joints: &[usize]| joints.first().map_or(DVec3::ONE, scale);
    let shown = |scale: DVec3| format!("[{:.4}, {:.4}, {:.4}]", scale.x, scale.y, scale.z);
    found.extend(places::about(rig, FindingCode::ZeroScale, &zero, |count| {
        format!("{count} with a scale of nothing, the first {}", shown(first(&zero)))
    }));
    found.extend(places::about(rig, FindingCode::NegativeScale, &negative, |count| {
        format!("{count} with a negative scale, the first {}", shown(first(&negative)))
    }));
    found.extend(places::about(rig, FindingCode::NonUniformScale, &uneven, |count| {
        format!("{count} with a scale that differs by axis, the first {}", shown(first(&uneven)))
    }));
    found.extend(places::about(rig, FindingCode::ScaledJoint, &inside, |count| {
        format!("{count} with a scale, the first {:.4}", first(&inside).abs().max_element())
    }));
    found.extend(places::about(rig, FindingCode::ScaleAboveSkeleton, &above, |_| {
        let total = above.iter().fold(1.0, |total, joint| total * scale(joint).abs().max_element());
        format!("the skeleton is scaled by {total:.5} from above")
    }));
    examine_shear(rig, facts, &relevant, found);
}

/// A node's transform as the file has it.
fn node(rig: &Rig<'_>, joint: usize) -> Transform {
    let stretched = rig.scene.stretched.as_ref().map(|stretched| stretched.nodes()[joint]);
    stretched.unwrap_or(rig.skeleton().joints()[joint].rest)
}

fn examine_shear(rig: &Rig<'_>, facts: FileFacts<'_>, relevant: &[usize], found: &mut Vec<Finding>) {
    let skeleton = rig.skeleton();
    let nodes = LocalPose::new((0..skeleton.len()).map(|joint| node(rig, joint)).collect()).to_model(skeleton);
    let is_sheared = |joint: &usize| {
        let own = node(rig, *joint);
        let above = skeleton.parent(*joint).map_or(DVec3::ONE, |parent| nodes.transforms()[parent].scale);
        !is_even(above) && above.abs().min_element() > NOTHING && !only_swaps_axes(own.rotation)
    };
    let sheared: Vec<usize> = relevant.iter().copied().filter(is_sheared).collect();
    let read = facts.warnings.iter().find(|warning| matches!(warning.code, "matrix_sheared" | "shear_lost"));
    let by_joint = places::about(rig, FindingCode::Shear, &sheared, |count| {
        format!("{count} turned below a scale that differs by axis")
    });
    let by_reader = || {
        let warning = read?;
        Some(Finding { code: FindingCode::Shear, place: warning.place.clone(), detail: warning.detail.clone() })
    };
    found.extend(by_joint.or_else(by_reader));
}

/// Joints of the rig and everything above them, parents before children.
fn relevant_joints(rig: &Rig<'_>) -> Vec<usize> {
    let skeleton = rig.skeleton();
    let mut relevant: Vec<bool> = skeleton.joints().iter().map(|joint| joint.is_joint).collect();
    for joint in rig.roles.values().flatten() {
        relevant[*joint] = true;
    }
    for joint in (0..skeleton.len()).rev() {
        if let Some(parent) = skeleton.parent(joint).filter(|_| relevant[joint]) {
            relevant[parent] = true;
        }
    }
    (0..skeleton.len()).filter(|joint| relevant[*joint]).collect()
}

/// Whether a joint is one of the skeleton, and not a node that carries it.
fn is_in_skeleton(rig: &Rig<'_>, joint: usize) -> bool {
    rig.skeleton().joints()[joint].is_joint || rig.roles.values().flatten().any(|other| *other == joint)
}

fn is_even(scale: DVec3) -> bool {
    let size = scale.abs();
    size.max_element() - size.min_element() <= EQUAL * size.max_element()
}

/// Whether a rotation is one of the 24 that take axes to axes.
fn only_swaps_axes(rotation: DQuat) -> bool {
    let is_axis = |direction: DVec3| direction.abs().max_element() > TURNED_RADIANS.cos();
    is_axis(rotation * DVec3::X) && is_axis(rotation * DVec3::Y) && is_axis(rotation * DVec3::Z)
}
