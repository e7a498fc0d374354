//! The rotations that bring a rig into the pose of a rest file: parents before children, bones keep their length.

use glam::{DQuat, DVec3};

use super::{
    super::super::{
        alignment::{arc, split},
        rig::Rig,
    },
    limbs::{Limb, Limbs},
    matching::Matching,
    wahba::{Direction, best_rotation},
};

/// Directions that lie within this say nothing of the turn about them, in degrees.
const FAN_DEGREES: f64 = 5.0;
/// What the directions of a joint leave open is as it was, with this weight against theirs.
const PRIOR_SHARE: f64 = 1e-5;
/// An elbow or knee that is straighter has no plane, in degrees.
const STRAIGHT_DEGREES: f64 = 5.0;
/// An elbow or knee whose plane turned by more is bent the other way, in degrees.
const MAX_ROLL_DEGREES: f64 = 100.0;

/// By joint, how far it is turned from the rig's rest pose, in the rig's model space.
pub(super) type Turns = Vec<Option<DQuat>>;

/// How far each joint is turned from the rig's rest pose, in model space. `known` are the turns that are known as a whole; they are
/// changed only as far as the directions need it.
pub(super) fn solved(rig: &Rig<'_>, matching: &Matching, limbs: &Limbs, known: &Turns) -> Vec<DQuat> {
    let base = base_of(rig);
    let mut turns: Vec<DQuat> = Vec::with_capacity(known.len());
    for (joint, known) in known.iter().enumerate() {
        let parent = rig.skeleton().parent(joint);
        let carried = parent.map_or(DQuat::IDENTITY, |parent| turns[parent]);
        let is_above = base.is_some_and(|base| base != joint && rig.skeleton().is_ancestor_or_self(joint, base));
        let turn = if is_above || matching.anchors[joint].is_none() {
            // What carries the whole body shows no pose: it lies as the axes of a file lie.
            if is_above { DQuat::IDENTITY } else { carried }
        } else {
            turned(rig, limbs, joint, carried, *known)
        };
        turns.push(turn.normalize());
    }
    turns
}

/// The joint that carries the body.
pub(super) fn base_of(rig: &Rig<'_>) -> Option<usize> {
    rig.role("pelvis").first().copied()
}

fn turned(rig: &Rig<'_>, limbs: &Limbs, joint: usize, carried: DQuat, known: Option<DQuat>) -> DQuat {
    let prior = known.unwrap_or(carried);
    // Where ends and helpers lie is no better known than how the joint is turned.
    let counts = |limb: &&Limb| limb.is_pose && (limb.is_named || known.is_none());
    let of_pose: Vec<&Limb> = limbs.of(joint).filter(counts).collect();
    if !limbs.is_one_build {
        if known.is_some() && of_pose.len() != 1 {
            return prior;
        }
        if known.is_none() && is_foot(rig, joint) {
            return flat_foot(rig, limbs, joint);
        }
    }
    let Some(main) = of_pose.iter().max_by(|one, other| one.weight.total_cmp(&other.weight)) else { return prior };
    let pole = rig.canonical_from_scene.conjugate() * DVec3::Z;
    let pointed = arc(prior * main.own.normalize(), main.wanted.normalize(), pole) * prior;
    if is_fan(&of_pose) {
        let direction = |limb: &&Limb| Direction {
            own: limb.own.normalize(),
            wanted: limb.wanted.normalize(),
            weight: limb.weight,
        };
        let directions: Vec<Direction> = of_pose.iter().map(direction).collect();
        let total: f64 = directions.iter().map(|direction| direction.weight).sum();
        return best_rotation(&directions, pointed, total * PRIOR_SHARE);
    }
    if known.is_some() {
        return pointed;
    }
    rolled(limbs, main, pointed)
}

/// Whether the directions of a joint spread enough to say how it is turned about each of them.
pub(super) fn is_fan(limbs: &[&Limb]) -> bool {
    let apart = |one: &Limb, other: &Limb| {
        let degrees = one.own.angle_between(other.own).to_degrees();
        (FAN_DEGREES..=180.0 - FAN_DEGREES).contains(&degrees)
    };
    limbs.iter().enumerate().any(|(index, limb)| limbs[index + 1..].iter().any(|other| apart(limb, other)))
}

/// Rolled until the bend of the joint below lies in the plane in which the rest file has it: elbows and knees are hinges.
fn rolled(limbs: &Limbs, upper: &Limb, pointed: DQuat) -> DQuat {
    let below = limbs.of(upper.to).filter(|limb| limb.is_pose);
    let Some(lower) = below.max_by(|one, other| one.weight.total_cmp(&other.weight)) else { return pointed };
    let bends = [(upper.own, lower.own), (upper.wanted, lower.wanted)];
    if !limbs.is_one_build
        || bends.iter().any(|(upper, lower)| upper.angle_between(*lower).to_degrees() < STRAIGHT_DEGREES)
    {
        return pointed;
    }
    let along = upper.wanted.normalize();
    let own = pointed * upper.own.cross(lower.own).normalize();
    let wanted = upper.wanted.cross(lower.wanted).normalize();
    let angle = own.cross(wanted).dot(along).atan2(own.dot(wanted));
    if angle.abs().to_degrees() > MAX_ROLL_DEGREES {
        return pointed;
    }
    DQuat::from_axis_angle(along, angle) * pointed
}

fn is_foot(rig: &Rig<'_>, joint: usize) -> bool {
    rig.roles.iter().any(|(role, joints)| split(role).1 == "foot" && joints.contains(&joint))
}

/// A foot keeps its sole on the floor, and points where the other body's does.
fn flat_foot(rig: &Rig<'_>, limbs: &Limbs, joint: usize) -> DQuat {
    let up = rig.up();
    let level = |direction: DVec3| (direction - up * direction.dot(up)).try_normalize();
    let toe = limbs.of(joint).next();
    let levels = toe.and_then(|toe| level(toe.own).zip(level(toe.wanted)));
    levels.map_or(DQuat::IDENTITY, |(own, wanted)| arc(own, wanted, up))
}
