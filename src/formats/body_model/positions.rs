//! Rotations from joint positions: the poses that put the joints where they were seen.
//!
//! The skeleton stands in the mean body's T pose with the bone lengths of the capture (the median over its frames). Pelvis and
//! chest, which have three children, are turned by two of their directions; every other joint by the shortest turn that points
//! its bone where it was seen. Positions say nothing of the roll of a limb, except through the bend of its elbow or knee: there
//! the roll is the one that bends it as elbows (to the front) and knees (to the back) bend, the more the more it is bent.

use glam::{DMat3, DQuat, DVec3};

use crate::{
    formats::{Budget, FormatError, Limit},
    model::Reporter,
};

use super::{
    Capture,
    features::FRAMES_PER_SECOND,
    refused,
    skeleton::{self, Body},
};

/// Bones that are shorter than this have no direction; meters.
const SHORTEST: f64 = 1e-6;
/// The bend at which a hinge begins to tell the roll, more than the mean body's at rest, and at which it tells all of it: sine of
/// the angle.
const HINGE_TELLS: [f64; 2] = [0.2, 0.45];

/// A joint whose child is a hinge: the hinge's own child, and where that points when bent, in rest space.
const HINGED: [(usize, usize, usize, DVec3); 4] = [
    (skeleton::LEFT_HIP, skeleton::LEFT_KNEE, skeleton::LEFT_ANKLE, DVec3::NEG_Z),
    (skeleton::RIGHT_HIP, skeleton::RIGHT_KNEE, skeleton::RIGHT_ANKLE, DVec3::NEG_Z),
    (skeleton::LEFT_SHOULDER, skeleton::LEFT_ELBOW, skeleton::LEFT_WRIST, DVec3::Z),
    (skeleton::RIGHT_SHOULDER, skeleton::RIGHT_ELBOW, skeleton::RIGHT_WRIST, DVec3::Z),
];

/// Solves positions, frame by frame and joint by joint; Y or Z up, any unit.
pub(super) fn solve(
    places: &[Vec<DVec3>],
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Capture, FormatError> {
    let joints = places.first().map_or(0, Vec::len);
    let body = Body::of_joint_count(joints).ok_or_else(|| refused("array", "there is no frame"))?;
    budget.take(Limit::Samples, (places.len() as u64).saturating_mul(joints as u64), "array")?;
    let y_up_from_file = y_up_from_file(places);
    let rest = measured(body, places)?;
    let mut rotations = vec![Vec::with_capacity(places.len()); joints];
    let mut pelvis = Vec::with_capacity(places.len());
    for seen in places {
        budget.check_canceled()?;
        let seen: Vec<DVec3> = seen.iter().map(|place| y_up_from_file * *place).collect();
        for (joint, rotation) in pose(&rest, &seen).into_iter().enumerate() {
            rotations[joint].push(rotation);
        }
        pelvis.push(seen[skeleton::PELVIS]);
    }
    reporter.warn(
        "roll_unknown",
        "",
        "positions do not say how limbs, head, hands and feet are turned about themselves; they turn as little as they can",
        "send rotations (SMPL parameters, BVH, FBX) where that matters",
    );
    Ok(Capture { skeleton: skeleton::skeleton_of(rest), rotations, pelvis, frames_per_second: FRAMES_PER_SECOND })
}

/// As it was seen, or turned from Z up: the axis that the head is above the pelvis along most of the time.
fn y_up_from_file(places: &[Vec<DVec3>]) -> DQuat {
    let up: DVec3 = places.iter().map(|seen| seen[skeleton::HEAD] - seen[skeleton::PELVIS]).sum();
    if up.z > up.y { DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2) } else { DQuat::IDENTITY }
}

/// The body with the bone lengths of the capture.
fn measured(body: Body, places: &[Vec<DVec3>]) -> Result<Vec<(String, Option<usize>, DVec3)>, FormatError> {
    let mut joints = body.joints();
    for index in 1..joints.len() {
        let Some(parent) = joints[index].1 else { continue };
        let mut lengths: Vec<f64> = places.iter().map(|seen| seen[index].distance(seen[parent])).collect();
        let middle = lengths.len() / 2;
        let (_, length, _) = lengths.select_nth_unstable_by(middle, f64::total_cmp);
        joints[index].2 = joints[index].2.normalize() * *length;
    }
    let leg = joints[skeleton::LEFT_KNEE].2.length() + joints[skeleton::LEFT_ANKLE].2.length();
    if leg < SHORTEST {
        return Err(refused("array", "all joints are in one place"));
    }
    Ok(joints)
}

/// `parent_from_joint` of every joint.
fn pose(rest: &[(String, Option<usize>, DVec3)], seen: &[DVec3]) -> Vec<DQuat> {
    let mut world = vec![DQuat::IDENTITY; rest.len()];
    let mut local = world.clone();
    for joint in 0..rest.len() {
        let parent = rest[joint].1.map_or(DQuat::IDENTITY, |parent| world[parent]);
        world[joint] = world_from_joint(joint, parent, rest, seen);
        local[joint] = (parent.inverse() * world[joint]).normalize();
    }
    local
}

fn world_from_joint(
    joint: usize,
    world_from_parent: DQuat,
    rest: &[(String, Option<usize>, DVec3)],
    seen: &[DVec3],
) -> DQuat {
    let trunk = match joint {
        skeleton::PELVIS => Some((skeleton::LEFT_HIP, skeleton::RIGHT_HIP, skeleton::SPINE)),
        skeleton::CHEST => Some((13, 14, skeleton::NECK)),
        _ => None,
    };
    if let Some((left, right, up)) = trunk {
        let at_rest = frame(rest[left].2 - rest[right].2, rest[up].2);
        let now = frame(seen[left] - seen[right], seen[up] - seen[joint]);
        return now.zip(at_rest).map_or(world_from_parent, |(now, at_rest)| now * at_rest.inverse());
    }
    let Some(child) = rest.iter().position(|(_, parent, _)| *parent == Some(joint)) else {
        return world_from_parent;
    };
    let (Some(bone), Some(now)) = (direction(rest[child].2), direction(seen[child] - seen[joint])) else {
        return world_from_parent;
    };
    let shortest = DQuat::from_rotation_arc(world_from_parent * bone, now) * world_from_parent;
    let hinge = HINGED.iter().find(|(first, ..)| *first == joint);
    hinge.map_or(shortest, |(_, hinge, end, bends_to)| {
        let beyond = seen[*end] - seen[*hinge];
        rolled(shortest, now, *bends_to, beyond)
    })
}

/// Turns a limb about itself so that its hinge bends where `beyond`, the bone after the hinge, was seen.
fn rolled(world_from_joint: DQuat, bone: DVec3, bends_to: DVec3, beyond: DVec3) -> DQuat {
    let Some(beyond) = direction(beyond) else { return world_from_joint };
    let seen = beyond.reject_from_normalized(bone);
    let expected = (world_from_joint * bends_to).reject_from_normalized(bone);
    let (Some(to), Some(from)) = (direction(seen), direction(expected)) else { return world_from_joint };
    let [begins, whole] = HINGE_TELLS;
    let told = ((seen.length() - begins) / (whole - begins)).clamp(0.0, 1.0);
    let angle = from.cross(to).dot(bone).atan2(from.dot(to));
    DQuat::from_axis_angle(bone, angle * told * told * (3.0 - 2.0 * told)) * world_from_joint
}

/// The rotation whose X is `across` and whose Y is nearest to `up`.
fn frame(across: DVec3, up: DVec3) -> Option<DQuat> {
    let x = direction(across)?;
    let y = direction(up.reject_from_normalized(x))?;
    Some(DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))))
}

fn direction(vector: DVec3) -> Option<DVec3> {
    (vector.length() > SHORTEST).then(|| vector.normalize())
}
