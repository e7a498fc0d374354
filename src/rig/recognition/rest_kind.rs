//! How a body holds its arms in its rest pose.

use std::collections::BTreeMap;

use super::{BodyFrame, Part, Role, RoleFinding, Side, facing::Points};
use crate::model::ModelPose;

/// How the arms are held, by their elevation from upper arm to hand against the body's horizontal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum RestPoseKind {
    /// Within 18° of horizontal.
    T,
    /// 18° to 72° below.
    A,
    /// More than 72° below.
    ArmsDown,
    /// Raised, held differently left and right, or not known.
    #[default]
    Other,
}

/// Arms lower or higher than this are no T pose, in degrees.
const T_DEGREES: f64 = 18.0;
/// Arms lower than this hang, in degrees.
const A_DEGREES: f64 = 72.0;
/// Arms that differ by more than this are no rest pose that we have a name for, in degrees.
const UNLIKE_DEGREES: f64 = 60.0;

impl RestPoseKind {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::T => "T",
            Self::A => "A",
            Self::ArmsDown => "arms_down",
            Self::Other => "other",
        }
    }
}

/// How the arms are held in a pose; [`RestPoseKind::Other`] without arms or a body frame.
#[must_use]
pub fn rest_pose_kind(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose, body: Option<&BodyFrame>) -> RestPoseKind {
    let points = Points { roles, pose };
    let Some(frame) = body else { return RestPoseKind::Other };
    let elevation = |side: Side| {
        let start = points.at(Role::new(side, Part::UpperArm))?;
        let end = points.at(Role::new(side, Part::Hand)).or_else(|| points.at(Role::new(side, Part::Forearm)))?;
        let direction = (end - start).try_normalize()?;
        Some(direction.dot(frame.up).clamp(-1.0, 1.0).asin().to_degrees())
    };
    let elevation = match (elevation(Side::Left), elevation(Side::Right)) {
        (Some(left), Some(right)) if (left - right).abs() > UNLIKE_DEGREES => None,
        (Some(left), Some(right)) => Some(left.midpoint(right)),
        (one, other) => one.or(other),
    };
    match elevation {
        Some(degrees) if degrees.abs() <= T_DEGREES => RestPoseKind::T,
        Some(degrees) if degrees < -A_DEGREES => RestPoseKind::ArmsDown,
        Some(degrees) if degrees < 0.0 => RestPoseKind::A,
        _ => RestPoseKind::Other,
    }
}
