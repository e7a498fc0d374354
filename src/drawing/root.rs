//! Where a drawing goes: the steps of its motion, as long as its legs are.

use glam::DVec2;

use super::{config::RootOffset, driver::Driver, error::DrawingError, plane::Plane, puppet::Puppet};

/// Where the root of a drawing is in each frame, seen from where it is in the first.
pub(super) fn root_path(
    offset: &RootOffset,
    plane: Plane,
    driver: &Driver,
    puppet: &Puppet,
) -> Result<Vec<DVec2>, DrawingError> {
    let place = |field: &str, chain: usize, joint: usize| format!("/char_bvh_root_offset/{field}/{chain}/{joint}");
    let mut of_motion = 0.0;
    for (index, chain) in offset.bvh_joints.iter().enumerate() {
        let joints =
            chain.iter().enumerate().map(|(joint, name)| driver.joint(place("bvh_joints", index, joint), name));
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        of_motion += joints.windows(2).map(|bone| driver.last_distance(bone[0], bone[1])).sum::<f64>();
    }
    let mut of_drawing = 0.0;
    for (index, chain) in offset.char_joints.iter().enumerate() {
        let joints =
            chain.iter().enumerate().map(|(joint, name)| puppet.joint(place("char_joints", index, joint), name));
        let joints = joints.collect::<Result<Vec<_>, _>>()?;
        of_drawing += joints.windows(2).map(|bone| puppet.rest[bone[0]].distance(puppet.rest[bone[1]])).sum::<f64>();
    }
    if !(of_motion > 0.0) {
        let detail = "the joints of the motion that its steps are measured with lie in one place";
        return Err(DrawingError::new("/char_bvh_root_offset/bvh_joints", detail, "name joints along the legs"));
    }
    let scale = of_drawing / of_motion;
    let mut at = DVec2::ZERO;
    let mut path = vec![at];
    for pair in driver.frames.windows(2) {
        let (step, forward) = (pair[1].root - pair[0].root, pair[1].forward);
        let across = match plane {
            Plane::Sagittal => forward,
            Plane::Frontal => glam::DVec3::new(-forward.z, forward.y, -forward.x),
        };
        at += scale * DVec2::new(across.dot(step), step.y);
        path.push(at);
    }
    Ok(path)
}
