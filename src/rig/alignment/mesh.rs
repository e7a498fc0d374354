//! What the skinned mesh of a joint says where no other joint does: which way it extends, and how flat it is.

use glam::{DMat3, DVec3};

use super::super::rig::Rig;

/// Fewer points are no shape.
const FEW_POINTS: usize = 12;
/// A mesh whose middle is further from its joint than this share of the body belongs somewhere else.
const FAR_SHARE: f64 = 0.25;
/// A mesh that is closer about its joint than this share of the body extends in no direction.
const NEAR_SHARE: f64 = 0.008;
/// How many times as wide as thick a hand is, at least.
const FLAT: f64 = 1.4;
/// The flat of a hand is off the line of its knuckles by about this much, in degrees.
const FLAT_DEGREES: f64 = 15.0;
/// Turns of the eigenvector iteration; each brings the axes of a hand closer by a factor of two or more.
const ITERATIONS: usize = 48;

/// The wide direction of a hand.
pub(super) struct Flat {
    /// Unit vector in the scene's model space; either of its two signs.
    pub(super) axis: DVec3,
    pub(super) uncertainty_degrees: f64,
}

/// From a joint to the middle of its points at rest, in the scene's model space.
pub(super) fn direction(rig: &Rig<'_>, joint: usize) -> Option<DVec3> {
    let (middle, _) = moments(rig, joint)?;
    middle.try_normalize()
}

/// The direction in which a joint's points are widest, square to the one in which they extend from the joint.
pub(super) fn flat(rig: &Rig<'_>, joint: usize) -> Option<Flat> {
    let (middle, spread) = moments(rig, joint)?;
    let along = middle.try_normalize()?;
    // What is left of the spread square to the bone; its larger axis lies in the palm.
    let square = DMat3::IDENTITY - outer(along, along);
    let across = square * spread * square;
    let wide = dominant(&across, along)?;
    let thick = along.cross(wide);
    let (wide_spread, thick_spread) = ((across * wide).dot(wide), (across * thick).dot(thick));
    (wide_spread > FLAT * FLAT * thick_spread).then_some(Flat { axis: wide, uncertainty_degrees: FLAT_DEGREES })
}

/// The middle of a joint's points against the joint, and their spread about that middle.
fn moments(rig: &Rig<'_>, joint: usize) -> Option<(DVec3, DMat3)> {
    let points = rig.scene.skin_points.of(joint);
    if points.len() < FEW_POINTS {
        return None;
    }
    let transform = &rig.rest.transforms()[joint];
    let offset = |position: glam::Vec3| transform.transform_point(position.as_dvec3()) - transform.translation;
    let weight: f64 = points.iter().map(|point| f64::from(point.weight)).sum();
    let middle = points.iter().map(|point| offset(point.position) * f64::from(point.weight)).sum::<DVec3>() / weight;
    let size = size(rig);
    if !(NEAR_SHARE * size..FAR_SHARE * size).contains(&middle.length()) {
        return None;
    }
    let spread = points.iter().fold(DMat3::ZERO, |sum, point| {
        let from_middle = offset(point.position) - middle;
        sum + outer(from_middle, from_middle) * f64::from(point.weight)
    });
    Some((middle, spread * weight.recip()))
}

/// How far the body's joints reach.
fn size(rig: &Rig<'_>) -> f64 {
    let joints = rig.roles.values().flatten().map(|joint| rig.rest.transforms()[*joint].translation);
    let (low, high) =
        joints.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), place| (low.min(place), high.max(place)));
    (high - low).max_element().max(0.0)
}

fn outer(first: DVec3, second: DVec3) -> DMat3 {
    DMat3::from_cols(first * second.x, first * second.y, first * second.z)
}

/// The eigenvector of the largest eigenvalue of a symmetric matrix whose range is square to `along`.
fn dominant(matrix: &DMat3, along: DVec3) -> Option<DVec3> {
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    // The longest column is not square to the eigenvector that is looked for.
    let mut vector =
        columns.into_iter().max_by(|one, other| one.length().total_cmp(&other.length()))?.try_normalize()?;
    for _ in 0..ITERATIONS {
        vector = (*matrix * vector).try_normalize()?;
    }
    (vector - along * vector.dot(along)).try_normalize()
}
