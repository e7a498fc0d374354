//! Turning the target's rest pose until it looks like the source's.
//!
//! Only the pose that is measured from is turned; no rig is changed. For every bone that has a role on both sides the
//! shortest arc from its own direction to the source's is applied, parents first, each correction carried down to the
//! children before their own is measured: an A pose turned into a T pose moves the whole arm at the shoulder, and the elbow
//! adds only what is left. (retargeting.md B14.)

use glam::{DQuat, DVec3};

use crate::model::{ModelPose, Skeleton, Transform};

use super::{auto_map::NamedPair, understand::Rig};

/// How a role's bones find their direction.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Rule {
    /// From the role's first joint to the first joint of one of these roles.
    Toward(&'static [&'static str]),
    /// The same, heading only: pitch and roll stay as the target has them, so soles stay flat.
    Heading(&'static [&'static str]),
    /// Along the chain, joint by joint.
    AlongChain,
    /// Keeps its own orientation in model space.
    Keep,
    /// Rides its parent.
    Ride,
}

/// One rule per role, without its side.
fn rule(part: &str) -> Rule {
    match part {
        "spine" => Rule::Toward(&["neck", "head"]),
        "neck" => Rule::Toward(&["head"]),
        "upper_arm" => Rule::Toward(&["forearm", "hand"]),
        "forearm" => Rule::Toward(&["hand"]),
        "hand" => Rule::Toward(&["middle", "index", "ring"]),
        "thigh" => Rule::Toward(&["shin", "foot"]),
        "shin" => Rule::Toward(&["foot"]),
        "foot" => Rule::Heading(&["toe"]),
        "thumb" | "index" | "middle" | "ring" | "pinky" => Rule::AlongChain,
        "front_leg" | "hind_leg" | "tail" => Rule::AlongChain,
        "head" | "clavicle" => Rule::Keep,
        _ => Rule::Ride,
    }
}

/// The target's rest pose, in the target's own space and unit, turned to look like the source's.
///
/// `pairs` are the chains that roles paired; their joints are turned, all others ride their parents.
pub(super) fn align(source: &Rig<'_>, target: &Rig<'_>, pairs: &[NamedPair]) -> ModelPose {
    let target_from_source = target.work_from_scene.conjugate() * source.work_from_scene;
    let skeleton = target.skeleton();
    let mut wishes: Vec<Option<Wish>> = vec![None; skeleton.len()];
    for pair in pairs {
        if let Some(role) = &pair.role {
            collect_wishes(source, target, pair, role, target_from_source, &mut wishes);
        }
    }
    turn(skeleton, target, &wishes)
}

/// What one joint is to be turned by.
#[derive(Clone, Copy, Debug)]
enum Wish {
    /// Until `own` (at rest, in model space) points along `wanted`.
    Point { own: DVec3, wanted: DVec3 },
    /// As above, but starting from the joint's own orientation in model space, about the up axis only.
    Head { own: DVec3, wanted: DVec3 },
    /// To its own orientation in model space.
    Keep,
    /// By what its chain's first joint was turned by.
    Follow(usize),
}

fn collect_wishes(
    source: &Rig<'_>,
    target: &Rig<'_>,
    pair: &NamedPair,
    role: &str,
    target_from_source: DQuat,
    wishes: &mut [Option<Wish>],
) {
    let (side_prefix, part) = split(role);
    let toward = |ends: &[&str]| {
        let end = ends.iter().map(|end| format!("{side_prefix}{end}"));
        let end = end.into_iter().find(|end| !source.role(end).is_empty() && !target.role(end).is_empty())?;
        let own = direction(target, pair.target[0], target.role(&end)[0])?;
        let wanted = target_from_source * direction(source, pair.source[0], source.role(&end)[0])?;
        Some((own, wanted))
    };
    let first = pair.target[0];
    match rule(part) {
        Rule::Toward(ends) => {
            if let Some((own, wanted)) = toward(ends) {
                wishes[first] = Some(Wish::Point { own, wanted });
                for &joint in &pair.target[1..] {
                    wishes[joint] = Some(Wish::Follow(first));
                }
            }
        }
        Rule::Heading(ends) => {
            wishes[first] = Some(Wish::Keep);
            let up = target.up();
            let level = |direction: DVec3| (direction - up * direction.dot(up)).try_normalize();
            if let Some((own, wanted)) = toward(ends)
                && let (Some(own), Some(wanted)) = (level(own), level(wanted))
            {
                wishes[first] = Some(Wish::Head { own, wanted });
            }
        }
        Rule::Keep => wishes[first] = Some(Wish::Keep),
        Rule::Ride => {}
        Rule::AlongChain => {
            let count = pair.target.len().min(pair.source.len());
            for position in 0..count.saturating_sub(1) {
                let own = direction(target, pair.target[position], pair.target[position + 1]);
                let wanted = direction(source, pair.source[position], pair.source[position + 1]);
                if let (Some(own), Some(wanted)) = (own, wanted) {
                    wishes[pair.target[position]] = Some(Wish::Point { own, wanted: target_from_source * wanted });
                }
            }
        }
    }
}

fn turn(skeleton: &Skeleton, target: &Rig<'_>, wishes: &[Option<Wish>]) -> ModelPose {
    let rest = target.rest.transforms();
    let mut turned: Vec<Transform> = Vec::with_capacity(rest.len());
    // model_from_model: how far each joint's orientation has been turned from its own.
    let mut turns: Vec<DQuat> = Vec::with_capacity(rest.len());
    for (joint, wish) in wishes.iter().enumerate() {
        let parent = skeleton.parent(joint);
        let carried = parent.map_or(DQuat::IDENTITY, |parent| turns[parent]);
        let own_turn = match wish {
            None => carried,
            Some(Wish::Keep) => DQuat::IDENTITY,
            Some(Wish::Head { own, wanted }) => arc(*own, *wanted, target.up()),
            Some(Wish::Follow(first)) => turns[*first],
            Some(Wish::Point { own, wanted }) => arc(carried * *own, *wanted, target.up()) * carried,
        };
        let local = &target.rest_local.transforms()[joint];
        let mut transform = parent.map_or(*local, |parent| turned[parent].then_child(local));
        transform.rotation = (own_turn * rest[joint].rotation).normalize();
        turned.push(transform);
        turns.push(own_turn);
    }
    ModelPose::new(turned)
}

/// The shortest rotation from one unit vector to another. For opposite ones, half a turn about `stable`, or about an axis
/// square to it where `stable` lies along them.
fn arc(from: DVec3, to: DVec3, stable: DVec3) -> DQuat {
    if from.dot(to) > -1.0 + 1e-9 {
        return DQuat::from_rotation_arc(from, to);
    }
    let axis = (stable - from * stable.dot(from)).try_normalize().unwrap_or_else(|| from.any_orthonormal_vector());
    DQuat::from_axis_angle(axis, std::f64::consts::PI)
}

fn direction(side: &Rig<'_>, from: usize, to: usize) -> Option<DVec3> {
    let position = |joint: usize| side.rest.transforms()[joint].translation;
    (position(to) - position(from)).try_normalize()
}

/// `left_upper_arm` into `left_` and `upper_arm`.
pub(super) fn split(role: &str) -> (&str, &str) {
    for prefix in ["left_", "right_"] {
        if let Some(part) = role.strip_prefix(prefix) {
            return (&role[..prefix.len()], part);
        }
    }
    ("", role)
}
