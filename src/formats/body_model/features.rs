//! HumanML3D's features: 263 numbers a frame, from which the joint positions follow.
//!
//! Per frame: turn of the root about the vertical (half the angle, radians per frame), its step along X and Z in its own heading,
//! its height; the places of the 21 other joints as seen from the root's heading; then rotations, velocities and contacts, which
//! repeat what the places say. The layout is that of Guo et al., "Generating Diverse and Natural 3D Human Motions from Text"
//! (2022).

use glam::{DQuat, DVec3};

use crate::formats::numpy::NumberArray;

pub(super) const WIDTH: usize = 263;
pub(super) const FRAMES_PER_SECOND: f64 = 20.0;
const JOINTS: usize = 22;
const FIRST_PLACE: usize = 4;

/// Where the joints are, frame by frame; meters, Y up.
pub(super) fn places(features: &NumberArray) -> Vec<Vec<DVec3>> {
    let frames = features.shape[0];
    let value = |frame: usize, column: usize| features.value(frame * WIDTH + column);
    let (mut half_turn, mut ground) = (0.0_f64, DVec3::ZERO);
    let mut places = Vec::with_capacity(frames);
    for frame in 0..frames {
        let world_from_heading = DQuat::from_xyzw(0.0, half_turn.sin(), 0.0, half_turn.cos()).inverse();
        if frame > 0 {
            // The step was made in the heading that the turn before it led to.
            ground += world_from_heading * DVec3::new(value(frame - 1, 1), 0.0, value(frame - 1, 2));
        }
        let mut joints = Vec::with_capacity(JOINTS);
        joints.push(ground + DVec3::Y * value(frame, 3));
        for joint in 1..JOINTS {
            let first = FIRST_PLACE + (joint - 1) * 3;
            let seen = DVec3::new(value(frame, first), value(frame, first + 1), value(frame, first + 2));
            joints.push(world_from_heading * seen + ground);
        }
        places.push(joints);
        half_turn += value(frame, 0);
    }
    places
}
