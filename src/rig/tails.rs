//! Tails: what of them may meet the floor.

use glam::DVec3;

use super::{
    floor::Stance,
    recognition::{Part, Role},
    rig::Rig,
};

/// The vertices that are extreme in some direction of a grid on the surface of a cube are looked at; its steps, in the joint's axes.
const STEPS: [f64; 7] = [-1.0, -0.6, -0.3, 0.0, 0.3, 0.6, 1.0];

/// A joint of a tail and what moves with it, in plan units.
#[derive(Clone, Debug)]
pub struct TailJoint {
    /// The joint.
    pub joint: usize,
    /// Points of the mesh that can be its lowest; where there is no mesh, the end of its bone.
    pub points: Vec<TailPoint>,
}

/// A point that moves with a joint of a tail.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TailPoint {
    /// From the joint, in its axes and in plan units.
    pub offset: DVec3,
    /// The share by which it moves with the joint, 0 to 1.
    pub weight: f64,
}

/// A tail from the body outward.
#[derive(Clone, Debug)]
pub struct Tail {
    /// Its joints.
    pub joints: Vec<TailJoint>,
    /// How far it is below the floor at rest.
    pub sunk: f64,
}

/// The tails of a rig.
pub(crate) fn find_tails(rig: &Rig<'_>) -> Vec<Tail> {
    let is_tail = |role: &str| role.parse::<Role>().is_ok_and(|role| role.part == Part::Tail);
    let tails = rig.roles.iter().filter(|(role, joints)| is_tail(role) && !joints.is_empty());
    tails.map(|(_, joints)| tail(rig, joints)).collect()
}

fn tail(rig: &Rig<'_>, joints: &[usize]) -> Tail {
    let rest = rig.rest.transforms();
    let joint = |(place, &joint): (usize, &usize)| {
        let outward = joints.get(place + 1).copied().or_else(|| beyond(rig, joint));
        TailJoint { joint, points: points(rig, joint, outward) }
    };
    let joints: Vec<TailJoint> = joints.iter().enumerate().map(joint).collect();
    let floor = rig.role("pelvis").first().map_or(f64::NEG_INFINITY, |&pelvis| Stance::of(rig, pelvis).floor);
    let height = |joint: &TailJoint| {
        let rest = &rest[joint.joint];
        let heights = joint.points.iter().map(|point| (rest.translation + rest.rotation * point.offset).dot(rig.up()));
        heights.fold(f64::INFINITY, f64::min)
    };
    let lowest = joints.iter().map(height).fold(f64::INFINITY, f64::min);
    Tail { joints, sunk: (floor - lowest).max(0.0) }
}

/// The joint that the last bone of a tail ends at.
fn beyond(rig: &Rig<'_>, last: usize) -> Option<usize> {
    (last + 1..rig.skeleton().len()).find(|joint| rig.skeleton().parent(*joint) == Some(last))
}

fn points(rig: &Rig<'_>, joint: usize, outward: Option<usize>) -> Vec<TailPoint> {
    let rest = &rig.rest.transforms()[joint];
    let vertices = rig.scene.skin_points.of(joint).iter();
    let vertices: Vec<TailPoint> = vertices
        .map(|point| TailPoint { offset: point.position.as_dvec3() * rest.scale, weight: f64::from(point.weight) })
        .collect();
    if vertices.is_empty() {
        let end = outward.map(|outward| rig.rest.transforms()[outward].translation - rest.translation);
        let point = |end: DVec3| TailPoint { offset: rest.rotation.conjugate() * end, weight: 1.0 };
        return end.map(point).into_iter().collect();
    }
    let directions =
        STEPS.into_iter().flat_map(|x| STEPS.into_iter().flat_map(move |y| STEPS.map(|z| DVec3::new(x, y, z))));
    let farthest = |direction: DVec3| {
        let reach = |point: &TailPoint| point.offset.dot(direction);
        vertices.iter().copied().max_by(|one, other| reach(one).total_cmp(&reach(other)))
    };
    let mut found: Vec<TailPoint> = Vec::new();
    for point in directions.filter(|direction| direction.abs().max_element() >= 1.0).filter_map(farthest) {
        if !found.contains(&point) {
            found.push(point);
        }
    }
    found
}
