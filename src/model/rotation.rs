//! The maths of rotations and of fades that every room shares.
//!
//! q and −q are one rotation. What interpolates or averages rotations first writes them on one hemisphere, with [`near`].

use std::{f64::consts::PI, ops::Neg};

use glam::{DQuat, DVec3, Quat};

/// A quaternion of either precision.
pub trait Quaternion: Copy + Neg<Output = Self> {
    /// The sum of the products of the components.
    fn product(self, other: Self) -> f64;
}

impl Quaternion for Quat {
    #[inline]
    fn product(self, other: Self) -> f64 {
        f64::from(self.dot(other))
    }
}

impl Quaternion for DQuat {
    #[inline]
    fn product(self, other: Self) -> f64 {
        self.dot(other)
    }
}

/// The same rotation, on the hemisphere of another.
#[inline]
#[must_use]
pub fn near<Q: Quaternion>(rotation: Q, other: Q) -> Q {
    if rotation.product(other) < 0.0 { -rotation } else { rotation }
}

/// The same rotation, on the hemisphere of the one before it where there is one.
#[inline]
#[must_use]
pub fn next_to<Q: Quaternion>(rotation: Q, before: Option<Q>) -> Q {
    before.map_or(rotation, |before| near(rotation, before))
}

/// The same rotations, each on the hemisphere of the one before.
pub fn join_hemispheres<Q: Quaternion>(rotations: &mut [Q]) {
    for index in 1..rotations.len() {
        rotations[index] = near(rotations[index], rotations[index - 1]);
    }
}

/// The angle of a rotation in degrees, 0 to 180; exact for small ones too.
#[must_use]
pub fn degrees(rotation: DQuat) -> f64 {
    (2.0 * rotation.xyz().length().atan2(rotation.w.abs())).to_degrees()
}

/// The angle of a rotation's turn about a unit axis, −π to π.
#[must_use]
pub fn twist_angle(rotation: DQuat, axis: DVec3) -> f64 {
    let along = rotation.xyz().dot(axis);
    let (along, w) = if rotation.w < 0.0 { (-along, -rotation.w) } else { (along, rotation.w) };
    2.0 * along.atan2(w)
}

/// Twists up to here are shared as they are: about as far as a shoulder turns an arm, in radians. Captures that go beyond come back the other
/// way, and fast: what a share loses on the rest of the way to half a turn, it loses slowly.
const MAX_TWIST: f64 = 120.0 / 180.0 * PI;

/// A twist of −π to π as joints share it: as it is up to 120°, and less and less beyond, down to nothing at half a turn, where both
/// directions meet.
#[must_use]
pub fn shared_twist(twist: f64) -> f64 {
    let beyond = (twist.abs() - MAX_TWIST).max(0.0) / (PI - MAX_TWIST);
    twist.clamp(-MAX_TWIST, MAX_TWIST) * (1.0 - beyond)
}

/// The part of a rotation that turns about a unit axis; none for a rotation by half a turn about an axis square to it.
#[must_use]
pub fn twist(rotation: DQuat, axis: DVec3) -> DQuat {
    let along = DVec3::new(rotation.x, rotation.y, rotation.z).dot(axis);
    let twist = DQuat::from_xyzw(axis.x * along, axis.y * along, axis.z * along, rotation.w);
    if twist.length_squared() < 1e-24 { DQuat::IDENTITY } else { twist.normalize() }
}

/// The angle from one direction to another about an axis that is perpendicular to both.
#[must_use]
pub fn signed_angle(from: DVec3, to: DVec3, axis: DVec3) -> f64 {
    axis.dot(from.cross(to)).atan2(from.dot(to))
}

/// From 0 to 1, with a slope of zero at both ends: `3x² − 2x³`.
#[must_use]
pub fn smoothstep(value: f64) -> f64 {
    let value = value.clamp(0.0, 1.0);
    value * value * (3.0 - 2.0 * value)
}

/// From 0 to 1, with slope and curvature of zero at both ends: `6x⁵ − 15x⁴ + 10x³`.
#[must_use]
pub fn smootherstep(value: f64) -> f64 {
    let value = value.clamp(0.0, 1.0);
    value * value * value * (value * (value * 6.0 - 15.0) + 10.0)
}

/// `value` up to `free`; from there it comes ever nearer to `most`, with a continuous slope.
#[must_use]
pub fn approach(value: f64, free: f64, most: f64) -> f64 {
    let room = most - free;
    if value <= free || room <= 0.0 { value.min(most) } else { free + room * ((value - free) / room).tanh() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations_are_written_on_one_hemisphere() {
        let turn = DQuat::from_rotation_y(0.3);
        assert_eq!(near(-turn, turn), turn);
        assert_eq!(next_to(-turn, None), -turn);
        let mut turns = [turn, -turn, -turn];
        join_hemispheres(&mut turns);
        assert_eq!(turns, [turn; 3]);
    }

    #[test]
    fn a_twist_is_the_turn_about_the_axis() {
        let twisted = DQuat::from_rotation_x(0.4) * DQuat::from_rotation_y(0.7);
        assert!((twist_angle(twisted, DVec3::Y) - 0.7).abs() < 1e-12);
        assert!((degrees(twist(twisted, DVec3::Y)) - 0.7_f64.to_degrees()).abs() < 1e-9);
        assert_eq!(twist(DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0), DVec3::Y), DQuat::IDENTITY);
        assert!((twist_angle(-twisted, DVec3::Y) - 0.7).abs() < 1e-12);
    }

    #[test]
    fn fades_end_at_zero_and_one() {
        for fade in [smoothstep, smootherstep] {
            assert_eq!([-1.0, 0.0, 0.5, 1.0, 2.0].map(fade), [0.0, 0.0, 0.5, 1.0, 1.0]);
        }
    }
}
