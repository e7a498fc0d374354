//! Poses that a body of any build can take: the T pose and the A pose.

use glam::{DQuat, DVec3};

use super::{
    look::{RollCue, Second, arm_convention_along},
    split,
};

/// How far below the horizontal the arms of an A pose are, in degrees.
const A_DEGREES: f64 = 45.0;
/// How far below the horizontal a foot points from its ankle to its toes, where nothing else is known, in degrees.
const FOOT_DEGREES: f64 = 30.0;

/// A pose by its name. Legs hang straight down, the trunk stands straight up, arms and fingers are straight, palms face down.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CanonicalPose {
    /// Arms horizontal.
    T,
    /// Arms 45° below the horizontal.
    A,
}

impl CanonicalPose {
    fn arm(self, side: &str) -> DVec3 {
        let degrees = if self == Self::T { 0.0 } else { A_DEGREES };
        let (down, out) = degrees.to_radians().sin_cos();
        DVec3::new(if side == "left_" { out } else { -out }, -down, 0.0)
    }

    /// Where a role points, +Y up, +Z front; nothing for parts that keep how they are.
    pub(super) fn direction(self, role: &str) -> Option<DVec3> {
        let (side, part) = split(role);
        match part {
            "spine" | "neck" => Some(DVec3::Y),
            "clavicle" => Some(if side == "left_" { DVec3::X } else { DVec3::NEG_X }),
            "upper_arm" | "forearm" | "hand" | "index" | "middle" | "ring" | "pinky" => Some(self.arm(side)),
            "thigh" | "shin" => Some(DVec3::NEG_Y),
            "foot" => Some(DQuat::from_rotation_x(FOOT_DEGREES.to_radians()) * DVec3::Z),
            _ => None,
        }
    }

    /// How a role is rolled.
    pub(super) fn second(self, role: &str) -> Option<Second> {
        let (side, part) = split(role);
        let exact = |axis: DVec3, cue: RollCue| Some(Second { axis, cue, uncertainty_degrees: 0.0 });
        match part {
            "spine" => exact(DVec3::X, RollCue::Shoulders),
            "upper_arm" | "forearm" => {
                let made = arm_convention_along(side, self.arm(side))?;
                exact(made.axis, RollCue::Convention)
            }
            "hand" => exact(DVec3::Z, RollCue::Knuckles),
            "thigh" | "shin" => exact(DVec3::X, RollCue::Foot),
            _ => None,
        }
    }
}
