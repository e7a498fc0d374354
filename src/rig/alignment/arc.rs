//! The shortest way from one direction to another.

use glam::{DQuat, DVec3};

/// The shortest rotation from one unit vector to another. For opposite ones half a turn about `pole`, or about an axis square to
/// it where `pole` lies along them: which way round the arc goes must not depend on rounding.
pub(crate) fn arc(from: DVec3, to: DVec3, pole: DVec3) -> DQuat {
    if from.dot(to) > -1.0 + 1e-9 {
        return DQuat::from_rotation_arc(from, to);
    }
    let axis = (pole - from * pole.dot(from)).try_normalize().unwrap_or_else(|| from.any_orthonormal_vector());
    DQuat::from_axis_angle(axis, std::f64::consts::PI)
}
