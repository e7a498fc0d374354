//! Which bones of a skeleton are drawn where there is no mesh.

use std::collections::BTreeSet;

use crate::{model::Skeleton, picture::Bone, rig::Rig};

/// The bones that are drawn: of a body those with roles and all below them, else all between what the file calls joints.
pub(super) fn drawn_bones(skeleton: &Skeleton, rig: Option<&Rig<'_>>) -> Vec<Bone> {
    let roles = || rig.into_iter().flat_map(|rig| rig.roles.iter().filter(|(role, _)| *role != "root"));
    let with_role: BTreeSet<usize> = roles().flat_map(|(_, joints)| joints.iter().copied()).collect();
    let is_trunk = |joint: usize| {
        let of_trunk = roles().filter(|(role, _)| matches!(role.as_str(), "pelvis" | "spine"));
        of_trunk.into_iter().any(|(_, joints)| joints.contains(&joint))
    };
    let has_joints = skeleton.joints().iter().any(|joint| joint.is_joint);
    let mut is_drawn = vec![false; skeleton.len()];
    for joint in 0..skeleton.len() {
        let above = skeleton.parent(joint).is_some_and(|parent| is_drawn[parent]);
        is_drawn[joint] = match with_role.is_empty() {
            true => skeleton.joints()[joint].is_joint || !has_joints,
            false => above || with_role.contains(&joint),
        };
    }
    let mut bones = Vec::new();
    for joint in (0..skeleton.len()).filter(|joint| is_drawn[*joint]) {
        let parent = skeleton.parent(joint).filter(|parent| is_drawn[*parent]);
        // Joints of limbs that hang on controls go on from the joint of the role before.
        let from = parent.or_else(|| rig.and_then(|rig| joint_before(rig, joint)));
        bones.extend(from.map(|from| Bone { from, to: joint, is_trunk: is_trunk(from) && is_trunk(joint) }));
    }
    bones
}

/// The joint that a body's joint goes on from by its role.
fn joint_before(rig: &Rig<'_>, joint: usize) -> Option<usize> {
    let (role, joints) = rig.roles.iter().find(|(role, joints)| *role != "root" && joints.contains(&joint))?;
    let place = joints.iter().position(|other| *other == joint)?;
    if let Some(before) = place.checked_sub(1) {
        return Some(joints[before]);
    }
    let (side, part) = ["left_", "right_"]
        .into_iter()
        .find_map(|side| role.strip_prefix(side).map(|part| (side, part)))
        .unwrap_or(("", role.as_str()));
    let before: &[&str] = match part {
        "spine" | "thigh" | "tail" => &["pelvis"],
        "shin" => &["thigh"],
        "foot" => &["shin"],
        "toe" => &["foot"],
        "clavicle" | "neck" => &["spine", "pelvis"],
        "upper_arm" => &["clavicle", "spine", "pelvis"],
        "forearm" => &["upper_arm"],
        "hand" => &["forearm"],
        "head" => &["neck", "spine"],
        _ => return None,
    };
    let last = |name: &&str| {
        [format!("{side}{name}"), (*name).to_owned()].iter().find_map(|role| rig.role(role).last().copied())
    };
    before.iter().find_map(last)
}
