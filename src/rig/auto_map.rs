//! Which chains drive which, when the spec does not say: equal roles, then equal names.

use std::collections::BTreeMap;

use super::{
    leg_rows::{driving_leg, is_whole_leg},
    legs::corresponding,
    named_pair::{NamedPair, split},
    recognition::{Role, Side},
    rig::Rig,
};

/// Roles that make up a limb, for specs that name the limb.
pub(crate) const LIMBS: [(&str, &[&str]); 4] = [
    ("left_arm", &["left_upper_arm", "left_forearm", "left_hand"]),
    ("right_arm", &["right_upper_arm", "right_forearm", "right_hand"]),
    ("left_leg", &["left_thigh", "left_shin", "left_foot"]),
    ("right_leg", &["right_thigh", "right_shin", "right_foot"]),
];

/// Roles that no chain is made of: the pelvis has an op of its own, and a root above it stays where it is.
const NO_CHAINS: [&str; 2] = ["pelvis", "root"];

/// Fingers, and those that move most as they do, the likest first: both for a finger of the target that the source lacks, and for
/// one of the source that the target lacks.
const NEIGHBORS: [(&str, &[&str]); 4] = [
    ("index", &["middle", "ring", "pinky"]),
    ("middle", &["ring", "index", "pinky"]),
    ("ring", &["middle", "pinky", "index"]),
    ("pinky", &["ring", "middle", "index"]),
];

/// The roles that a name stands for: itself, or the parts of a limb.
pub(crate) fn roles_of(name: &str) -> Vec<&str> {
    LIMBS.iter().find(|(limb, _)| *limb == name).map_or_else(|| vec![name], |(_, roles)| roles.to_vec())
}

/// Names that a chain may be called by on a side, besides those that the spec defines.
pub(crate) fn known_names(side: &Rig<'_>) -> Vec<String> {
    let limbs = LIMBS.iter().filter(|(_, roles)| roles.iter().all(|role| !side.role(role).is_empty()));
    let roles = side.roles.keys().filter(|role| !NO_CHAINS.contains(&role.as_str())).cloned();
    roles.chain(limbs.map(|(limb, _)| (*limb).to_owned())).collect()
}

/// Pairs by role: every role that both sides have; fingers that the source lacks with the finger beside them, so that a hand
/// closes as a whole; legs of creatures that have other numbers of them from front to hind; necks, heads, wings and tails that the
/// source has one of with that one, so that a hydra's heads look as one. Fingers that the target lacks move the finger beside them,
/// together with its own.
pub(crate) fn by_role(source: &Rig<'_>, target: &Rig<'_>) -> Vec<NamedPair> {
    let roles = target.roles.iter().filter(|(role, _)| !NO_CHAINS.contains(&role.as_str()));
    let mut pairs: Vec<NamedPair> =
        roles.filter_map(|(role, _)| role_pair(source, &driving_role(role, source, target)?, target, role)).collect();
    for (role, joints) in source.roles.iter().filter(|(role, _)| !is_whole_leg(role)) {
        let is_free = !pairs.iter().any(|pair| pair.source_name == *role);
        let falls_on = beside(role, target).filter(|_| is_free && !joints.is_empty());
        if let Some(pair) = pairs.iter_mut().find(|pair| Some(&pair.name) == falls_on.as_ref()) {
            pair.also.push((role.clone(), joints.clone()));
        }
    }
    pairs
}

/// A role of the source that drives a role of the target; nothing where either has no joints.
pub(crate) fn role_pair(source: &Rig<'_>, from: &str, target: &Rig<'_>, to: &str) -> Option<NamedPair> {
    let (source_joints, target_joints) = (source.role(from), target.role(to));
    let (source, target) = if is_whole_leg(to) {
        corresponding(source, source_joints, target, target_joints)
    } else {
        (source_joints.to_vec(), target_joints.to_vec())
    };
    let role = stands_in(from, to).then(|| to.to_owned());
    let is_whole = !source.is_empty() && !target.is_empty();
    is_whole.then(|| NamedPair {
        name: to.to_owned(),
        source_name: from.to_owned(),
        source,
        also: Vec::new(),
        target,
        role,
    })
}

/// The role of the source that drives a role of the target.
fn driving_role(role: &str, source: &Rig<'_>, target: &Rig<'_>) -> Option<String> {
    let wanted: Option<Role> = role.parse().ok();
    if let Some(leg) = wanted.filter(|_| is_whole_leg(role)) {
        return driving_leg(source, target, leg).map(|leg| leg.to_string());
    }
    beside(role, source).or_else(|| Some(first_alike(source, wanted?)?.to_string()))
}

/// The role of a rig that answers to a role of another: the same, and for fingers that it lacks, the one beside.
fn beside(role: &str, rig: &Rig<'_>) -> Option<String> {
    if !rig.role(role).is_empty() {
        return Some(role.to_owned());
    }
    let (side, part) = split(role);
    let neighbors = NEIGHBORS.iter().find(|entry| entry.0 == part)?.1;
    neighbors.iter().map(|part| format!("{side}{part}")).find(|role| !rig.role(role).is_empty())
}

/// Of a part that creatures have several of, the first that the source has: on the same side, in the middle, else on any.
fn first_alike(source: &Rig<'_>, role: Role) -> Option<Role> {
    let sides = [role.side, Side::Center, Side::Left, Side::Right].into_iter();
    let first = |side: Side| Role::new(side, role.part);
    let may_follow = |other: &Role| role.may_follow(*other) && !source.role(&other.to_string()).is_empty();
    sides.map(first).find(may_follow)
}

/// Whether a role of the source may stand in for another of the target: fingers of one hand, legs of one side, one neck for several.
fn stands_in(source: &str, target: &str) -> bool {
    if let (Ok(from), Ok(to)) = (source.parse::<Role>(), target.parse::<Role>())
        && (to.may_follow(from) || (from.side == to.side && is_whole_leg(source) && is_whole_leg(target)))
    {
        return true;
    }
    let (from, to) = (split(source), split(target));
    from == to || (from.0 == to.0 && NEIGHBORS.iter().any(|(part, beside)| *part == to.1 && beside.contains(&from.1)))
}

/// Pairs of joints that are called the same and that no role took on either side. Only below the pelvis, and only joints:
/// armatures and meshes of equal names mean nothing.
pub(crate) fn by_name(source: &Rig<'_>, target: &Rig<'_>, taken: &[NamedPair]) -> Vec<NamedPair> {
    let (Some(&source_pelvis), Some(&target_pelvis)) = (source.role("pelvis").first(), target.role("pelvis").first())
    else {
        return Vec::new();
    };
    let free = |side: &Rig<'_>, joint: usize, joints: fn(&NamedPair) -> &[usize]| {
        side.skeleton().joints()[joint].is_joint
            && !taken.iter().any(|pair| joints(pair).contains(&joint))
            && !side.role("pelvis").contains(&joint)
    };
    let is_source = |joint: usize| {
        source.skeleton().is_ancestor_or_self(source_pelvis, joint) && free(source, joint, |pair| &pair.source)
    };
    let is_target = |joint: usize| {
        target.skeleton().is_ancestor_or_self(target_pelvis, joint) && free(target, joint, |pair| &pair.target)
    };
    // What has another role in each is called the same by chance: `joint_17` of a wing and of a leg.
    let role_of = |side: &Rig<'_>, joint: usize| {
        let mut roles = side.roles.iter().filter(|(_, joints)| joints.contains(&joint));
        roles.next().map(|(role, _)| role.clone())
    };
    let differ = |pair: &NamedPair| {
        let roles = role_of(source, pair.source[0]).zip(role_of(target, pair.target[0]));
        roles.is_some_and(|(source, target)| source != target)
    };
    let mut pairs = twins(source, target, is_source, is_target);
    pairs.retain(|pair| !differ(pair));
    pairs
}

/// Joint by joint by equal names, for two skeletons that no body was recognized in: what a studio calls a crane it calls so in
/// every file. Nothing where fewer than half of the smaller skeleton's joints have a twin, which is chance.
pub(crate) fn by_name_alone(source: &Rig<'_>, target: &Rig<'_>) -> Vec<NamedPair> {
    let (source_joints, target_joints) = (countable(source), countable(target));
    let pairs = twins(source, target, |joint| source_joints[joint], |joint| target_joints[joint]);
    let count = |joints: &[bool]| joints.iter().filter(|is_joint| **is_joint).count();
    let least = count(&source_joints).min(count(&target_joints)).div_ceil(2).max(2);
    if pairs.len() < least { Vec::new() } else { pairs }
}

/// Which nodes count as joints: those that the file calls so, or all where it calls none so.
fn countable(side: &Rig<'_>) -> Vec<bool> {
    let joints = side.skeleton().joints();
    let flagged = joints.iter().any(|joint| joint.is_joint);
    joints.iter().map(|joint| joint.is_joint || !flagged).collect()
}

fn twins(
    source: &Rig<'_>,
    target: &Rig<'_>,
    is_source: impl Fn(usize) -> bool,
    is_target: impl Fn(usize) -> bool,
) -> Vec<NamedPair> {
    let sources = unique_names(source, is_source);
    let targets = unique_names(target, is_target);
    let mut pairs: Vec<NamedPair> = targets
        .into_iter()
        .filter_map(|(name, joint)| {
            let twin = *sources.get(name)?;
            Some(NamedPair {
                name: name.to_owned(),
                source_name: name.to_owned(),
                source: vec![twin],
                also: Vec::new(),
                target: vec![joint],
                role: None,
            })
        })
        .collect();
    pairs.sort_by_key(|pair| pair.target[0]);
    pairs
}

/// Joints by name, of those that are wanted and whose name no other has.
fn unique_names<'a>(side: &Rig<'a>, is_wanted: impl Fn(usize) -> bool) -> BTreeMap<&'a str, usize> {
    let mut by_name: BTreeMap<&str, Option<usize>> = BTreeMap::new();
    for (index, joint) in side.skeleton().joints().iter().enumerate().filter(|(_, joint)| !joint.name.is_empty()) {
        by_name.entry(&joint.name).and_modify(|joint| *joint = None).or_insert(Some(index));
    }
    by_name.into_iter().filter_map(|(name, joint)| Some((name, joint.filter(|joint| is_wanted(*joint))?))).collect()
}
