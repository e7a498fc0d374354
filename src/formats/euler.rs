//! Rotations into three angles that change smoothly over time.
//!
//! Every rotation has two triples of angles, each repeating every full turn; the one nearest to the previous frame's is
//! taken. Where the middle axis makes the outer two coincide, only their sum is defined: the first stays as it was.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};

/// Within this cosine of the middle angle, the outer two are noise.
const GIMBAL_COSINE: f64 = 0.01;
/// Holding the first angle may turn a joint by this much, about what an f32 quaternion cannot tell apart.
const GIMBAL_ERROR_RADIANS: f64 = 5e-7;

/// An order of three different axes, by index; the first one is applied last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::formats) struct EulerOrder([usize; 3]);

impl EulerOrder {
    /// What motion capture files use most.
    pub(in crate::formats) const ZXY: Self = Self([2, 0, 1]);
    /// What FBX calls XYZ.
    pub(in crate::formats) const ZYX: Self = Self([2, 1, 0]);

    /// The axes, in the order of the channels.
    pub(in crate::formats) const fn axes(self) -> [usize; 3] {
        self.0
    }

    /// The rotation of three angles in radians.
    pub(in crate::formats) fn compose(self, angles: [f64; 3]) -> DQuat {
        let turn = |position: usize| DQuat::from_axis_angle(DVec3::AXES[self.0[position]], angles[position]);
        turn(0) * turn(1) * turn(2)
    }

    /// Angles in radians that give a unit rotation, the nearest ones to `previous`; without one, those with the middle
    /// angle within a quarter turn.
    pub(in crate::formats) fn decompose(self, rotation: DQuat, previous: Option<[f64; 3]>) -> [f64; 3] {
        let matrix = DMat3::from_quat(rotation);
        let sign = self.sign();
        let [i, j, k] = self.0;
        let at = |row: usize, column: usize| matrix.col(column)[row];
        let cosine = at(i, i).hypot(at(i, j));
        let first = (-sign * at(j, k)).atan2(at(k, k));
        let middle = (sign * at(i, k)).atan2(cosine);
        let last = (-sign * at(i, j)).atan2(at(i, i));
        let Some(previous) = previous else { return [first, middle, last] };
        if cosine < GIMBAL_COSINE
            && let Some(held) = self.hold_first(rotation, previous)
        {
            return held;
        }
        let one = unwrapped([first, middle, last], previous);
        let other = unwrapped([first + PI, PI - middle, last + PI], previous);
        if distance(other, previous) < distance(one, previous) { other } else { one }
    }

    /// The angles with the first as it was, where they still give the rotation.
    fn hold_first(self, rotation: DQuat, previous: [f64; 3]) -> Option<[f64; 3]> {
        let [i, j, k] = self.0;
        let sign = self.sign();
        let without_first = DMat3::from_quat(DQuat::from_axis_angle(DVec3::AXES[i], -previous[0]) * rotation);
        let at = |row: usize, column: usize| without_first.col(column)[row];
        let middle = (sign * at(i, k)).atan2(at(k, k));
        let last = (sign * at(j, i)).atan2(at(j, j));
        let held = unwrapped([previous[0], middle, last], previous);
        let back = self.compose(held);
        let error = 2.0 * (back - rotation).length().min((back + rotation).length());
        (error < GIMBAL_ERROR_RADIANS).then_some(held)
    }

    /// 1 for XYZ and its rotations, −1 for the others.
    const fn sign(self) -> f64 {
        if (self.0[0] + 1) % 3 == self.0[1] { 1.0 } else { -1.0 }
    }
}

/// Each angle, moved by whole turns to where it is nearest to the previous one.
fn unwrapped(angles: [f64; 3], previous: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| angles[axis] + ((previous[axis] - angles[axis]) / TAU).round() * TAU)
}

fn distance(angles: [f64; 3], previous: [f64; 3]) -> f64 {
    angles.iter().zip(previous).map(|(angle, before)| (angle - before).powi(2)).sum()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];

    proptest! {
        #[test]
        fn angles_give_the_rotation_back(
            a in -PI..PI, b in -PI..PI, c in -PI..PI, before in prop::array::uniform3(-10.0..10.0_f64)
        ) {
            for axes in ORDERS {
                let order = EulerOrder(axes);
                let rotation = order.compose([a, b, c]);
                for previous in [None, Some(before)] {
                    let back = order.compose(order.decompose(rotation, previous));
                    let error = (back - rotation).length().min((back + rotation).length());
                    prop_assert!(error < 1e-6, "{axes:?} {previous:?}: {error}");
                }
            }
        }
    }

    #[test]
    fn several_turns_about_one_axis_stay_continuous() {
        for axes in ORDERS {
            let order = EulerOrder(axes);
            for axis in 0..3 {
                let mut previous = None;
                for frame in 0..400 {
                    let mut angles = [0.0; 3];
                    angles[axis] = f64::from(frame) * 0.05;
                    let found = order.decompose(order.compose(angles), previous);
                    let step = previous.map_or(0.0, |previous| distance(found, previous).sqrt());
                    assert!(step < 0.06, "{axes:?}, axis {axis}, frame {frame}: a step of {step}");
                    previous = Some(found);
                }
            }
        }
    }

    #[test]
    fn noise_at_the_gimbal_does_not_spin_the_outer_axes() {
        let order = EulerOrder::ZXY;
        let mut previous = Some(order.decompose(order.compose([0.3, PI / 2.0 - 0.02, 0.1]), None));
        for frame in 0..100 {
            let noise = if frame % 2 == 0 { 1e-7 } else { -1e-7 };
            let rotation = order.compose([0.3, PI / 2.0, 0.1]) * DQuat::from_rotation_x(noise);
            let found = order.decompose(rotation, previous);
            let step = previous.map_or(0.0, |previous| distance(found, previous).sqrt());
            assert!(step < 0.03, "frame {frame}: a step of {step} radians");
            previous = Some(found);
        }
    }
}
