//! Where the root of the drawing goes.

use glam::{DVec2, DVec3};

use super::{BodyMotion, DrawingError, PlanarRig, Plane, RootOffset};

/// The way of the root in the drawing's lengths; zero at the first frame. Where the drawing is mirrored, it goes the other way.
pub(super) fn way(
    offset: &RootOffset,
    plane: Plane,
    motion: &BodyMotion,
    rig: &PlanarRig,
    is_mirrored: &[bool],
) -> Result<Vec<DVec2>, DrawingError> {
    let scale = scale(offset, motion, rig)?;
    let mut at = DVec2::ZERO;
    let mut ways = vec![at];
    for (frame, &is_mirrored) in is_mirrored.iter().enumerate().take(motion.frames()).skip(1) {
        let step = motion.roots[frame] - motion.roots[frame - 1];
        let forward = motion.forwards[frame];
        let right = match plane {
            Plane::Sagittal => forward,
            Plane::Frontal => DVec3::new(-forward.z, forward.y, -forward.x),
        };
        let side = if is_mirrored { -1.0 } else { 1.0 };
        at += scale * DVec2::new(side * right.dot(step), step.y);
        ways.push(at);
    }
    Ok(ways)
}

/// Widest way of a root that is seen whole, in sides of the drawing's square.
const MAX_WAY: f64 = 1.5;
/// Over so many seconds the camera follows one who goes farther.
const FOLLOWED_OVER_SECONDS: f64 = 0.5;

/// How far to the right the camera is at each frame: it stays where the whole way can be seen, and goes along with one who goes farther,
/// or always where `stay` says so.
pub(super) fn pan(ways: &[DVec2], frame_time: f64, stay: Option<bool>) -> Vec<f64> {
    let least = ways.iter().map(|way| way.x).fold(f64::MAX, f64::min);
    let most = ways.iter().map(|way| way.x).fold(f64::MIN, f64::max);
    if !stay.unwrap_or(most - least > MAX_WAY) {
        return vec![0.0; ways.len()];
    }
    // A mean over frames before and after, weighted by how near they are.
    let reach = (FOLLOWED_OVER_SECONDS / frame_time).ceil() as isize;
    let last = ways.len() as isize - 1;
    let mean = |frame: isize| {
        let weight = |away: isize| 1.0 - (away as f64 / (reach + 1) as f64).powi(2);
        let part = |away: isize| weight(away) * ways[(frame + away).clamp(0, last) as usize].x;
        let sum: f64 = (-reach..=reach).map(part).sum();
        sum / (-reach..=reach).map(weight).sum::<f64>()
    };
    (0..=last).map(mean).collect()
}

/// Lengths of the drawing over lengths of the body. The body is measured at its last frame.
fn scale(offset: &RootOffset, motion: &BodyMotion, rig: &PlanarRig) -> Result<f64, DrawingError> {
    let last = motion.frames() - 1;
    let body = chains("bvh_joints", &offset.bvh_joints, &motion.joint_names, |one, other| {
        motion.place(last, one).distance(motion.place(last, other))
    })?;
    let drawing = chains("char_joints", &offset.char_joints, &rig.joint_names, |one, other| {
        rig.rest[one].distance(rig.rest[other])
    })?;
    if body <= 0.0 {
        let place = "char_bvh_root_offset.bvh_joints";
        return Err(DrawingError::new(place, "the chains have no length", "name chains of two joints or more"));
    }
    Ok(drawing / body)
}

fn chains(
    field: &str,
    chains: &[Vec<String>],
    names: &[String],
    distance: impl Fn(usize, usize) -> f64,
) -> Result<f64, DrawingError> {
    let mut sum = 0.0;
    for (index, chain) in chains.iter().enumerate() {
        let mut before = None;
        for (at, name) in chain.iter().enumerate() {
            let joint = names.iter().position(|joint| joint == name).ok_or_else(|| {
                let place = format!("char_bvh_root_offset.{field}[{index}][{at}]");
                DrawingError::unknown_name(place, name, names)
            })?;
            if let Some(before) = before.replace(joint) {
                sum += distance(before, joint);
            }
        }
    }
    Ok(sum)
}
