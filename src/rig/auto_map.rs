//! Which chains drive which, when the spec does not say: equal roles, then equal names.

use super::understand::Rig;

/// A chain on one side: its name and its joints from the body outward.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NamedPair {
    pub(super) name: String,
    pub(super) source: Vec<usize>,
    pub(super) target: Vec<usize>,
    /// The role, where the pair comes from one.
    pub(super) role: Option<String>,
}

/// Roles that make up a limb, for specs that name the limb.
const LIMBS: [(&str, &[&str]); 4] = [
    ("left_arm", &["left_upper_arm", "left_forearm", "left_hand"]),
    ("right_arm", &["right_upper_arm", "right_forearm", "right_hand"]),
    ("left_leg", &["left_thigh", "left_shin", "left_foot"]),
    ("right_leg", &["right_thigh", "right_shin", "right_foot"]),
];

/// Roles that no chain is made of: the pelvis has an op of its own, and a root above it stays where it is.
const NO_CHAINS: [&str; 2] = ["pelvis", "root"];

/// The roles that a name stands for: itself, or the parts of a limb.
pub(super) fn roles_of(name: &str) -> Vec<&str> {
    LIMBS.iter().find(|(limb, _)| *limb == name).map_or_else(|| vec![name], |(_, roles)| roles.to_vec())
}

/// Names that a chain may be called by on a side, besides those that the spec defines.
pub(super) fn known_names(side: &Rig<'_>) -> Vec<String> {
    let limbs = LIMBS.iter().filter(|(_, roles)| roles.iter().all(|role| !side.role(role).is_empty()));
    let roles = side.roles.keys().filter(|role| !NO_CHAINS.contains(&role.as_str())).cloned();
    roles.chain(limbs.map(|(limb, _)| (*limb).to_owned())).collect()
}

/// Pairs by role: every role that both sides have.
pub(super) fn by_role(source: &Rig<'_>, target: &Rig<'_>) -> Vec<NamedPair> {
    let roles = target.roles.iter().filter(|(role, _)| !NO_CHAINS.contains(&role.as_str()));
    roles
        .filter_map(|(role, joints)| {
            let source_joints = source.role(role);
            let pair = || NamedPair {
                name: role.clone(),
                source: source_joints.to_vec(),
                target: joints.clone(),
                role: Some(role.clone()),
            };
            (!source_joints.is_empty() && !joints.is_empty()).then(pair)
        })
        .collect()
}

/// Pairs of joints that are called the same and that no role took on either side. Only below the pelvis, and only joints:
/// armatures and meshes of equal names mean nothing.
pub(super) fn by_name(source: &Rig<'_>, target: &Rig<'_>, taken: &[NamedPair]) -> Vec<NamedPair> {
    let (Some(&source_pelvis), Some(&target_pelvis)) = (source.role("pelvis").first(), target.role("pelvis").first())
    else {
        return Vec::new();
    };
    let free = |side: &Rig<'_>, joint: usize, joints: fn(&NamedPair) -> &[usize]| {
        side.skeleton().joints()[joint].is_joint
            && !taken.iter().any(|pair| joints(pair).contains(&joint))
            && !side.role("pelvis").contains(&joint)
    };
    let mut pairs = Vec::new();
    for (index, joint) in target.skeleton().joints().iter().enumerate() {
        let below = target.skeleton().is_ancestor_or_self(target_pelvis, index);
        if joint.name.is_empty() || !below || !free(target, index, |pair| &pair.target) {
            continue;
        }
        let Some(twin) = source.skeleton().find(&joint.name) else { continue };
        let twin_below = source.skeleton().is_ancestor_or_self(source_pelvis, twin);
        if twin_below && free(source, twin, |pair| &pair.source) {
            let (source, target) = (vec![twin], vec![index]);
            pairs.push(NamedPair { name: joint.name.clone(), source, target, role: None });
        }
    }
    pairs
}
