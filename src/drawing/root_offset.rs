//! Where the root of the drawing goes.

use glam::{DVec2, DVec3};

use super::{BodyMotion, DrawingError, PlanarRig, Plane, RootOffset};

/// The way of the root in the drawing's lengths; zero at the first frame.
pub(super) fn way(
    offset: &RootOffset,
    plane: Plane,
    motion: &BodyMotion,
    rig: &PlanarRig,
) -> Result<Vec<DVec2>, DrawingError> {
    let scale = scale(offset, motion, rig)?;
    let mut at = DVec2::ZERO;
    let mut ways = vec![at];
    for frame in 1..motion.frames() {
        let step = motion.roots[frame] - motion.roots[frame - 1];
        let forward = motion.forwards[frame];
        let right = match plane {
            Plane::Sagittal => forward,
            Plane::Frontal => DVec3::new(-forward.z, forward.y, -forward.x),
        };
        at += scale * DVec2::new(right.dot(step), step.y);
        ways.push(at);
    }
    Ok(ways)
}

/// Widest way of a root that is followed, in sides of the drawing's square.
const MAX_WAY: f64 = 1.0;

/// Keeps a root that goes too far to the sides where it is; says whether it did.
pub(super) fn stay(ways: &mut [DVec2]) -> bool {
    let least = ways.iter().map(|way| way.x).fold(f64::MAX, f64::min);
    let most = ways.iter().map(|way| way.x).fold(f64::MIN, f64::max);
    let is_far = most - least > MAX_WAY;
    if is_far {
        ways.iter_mut().for_each(|way| way.x = 0.0);
    }
    is_far
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
