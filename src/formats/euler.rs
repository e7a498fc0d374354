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
pub struct EulerOrder([usize; 3]);

impl EulerOrder {
    /// What motion capture files use most.
    pub(in crate::formats) const ZXY: Self = Self([2, 0, 1]);
    /// What FBX calls XYZ.
    pub(in crate::formats) const ZYX: Self = Self([2, 1, 0]);

    /// All orders of three different axes.
    pub const ALL: [Self; 6] =
        [Self([0, 1, 2]), Self([0, 2, 1]), Self([1, 0, 2]), Self([1, 2, 0]), Self([2, 0, 1]), Self([2, 1, 0])];

    /// The order by the names of its axes as channels list them, such as `zxy`; nothing where it is none.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|order| order.name().eq_ignore_ascii_case(name))
    }

    /// The names of its axes, in the order of the channels.
    pub(in crate::formats) fn name(self) -> String {
        self.0.iter().map(|axis| ["X", "Y", "Z"][*axis]).collect()
    }

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

    /// How near a rotation is to where the outer two axes are one: |sin| of the middle angle, 1 at the gimbal.
    fn exposure(self, rotation: DQuat) -> f64 {
        let [i, _, k] = self.0;
        DMat3::from_quat(rotation).col(k)[i].abs()
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

/// Finds the order in which the angles of one joint change least from frame to frame.
///
/// The usual order is kept where it stays clear of its gimbal. Where it does not, all six are tried, and the one whose largest step is
/// the least is taken. (retargeting.md B25.)
#[derive(Clone, Debug)]
pub(in crate::formats) struct OrderChoice {
    usual: EulerOrder,
    exposure: f64,
    tried: [Tried; 6],
}

/// One order as it does so far: the angles of the last frame, and the largest step of any.
#[derive(Clone, Copy, Debug, Default)]
struct Tried {
    angles: Option<[f64; 3]>,
    largest_step: f64,
}

/// Sine of the middle angle from which the outer two turn several times as fast as the joint does.
const NEAR_GIMBAL: f64 = 0.9;
/// Another order has to be better than the usual one by this factor.
const WORTH_IT: f64 = 0.95;

impl OrderChoice {
    pub(in crate::formats) const fn new(usual: EulerOrder) -> Self {
        Self { usual, exposure: 0.0, tried: [Tried { angles: None, largest_step: 0.0 }; 6] }
    }

    /// Looks at one frame.
    pub(in crate::formats) fn look(&mut self, rotation: DQuat) {
        self.exposure = self.exposure.max(self.usual.exposure(rotation));
    }

    /// Whether the frames that were looked at come near the gimbal of the usual order.
    pub(in crate::formats) fn is_in_doubt(&self) -> bool {
        self.exposure > NEAR_GIMBAL
    }

    /// Tries all orders on the next frame.
    pub(in crate::formats) fn try_all(&mut self, rotation: DQuat) {
        for (order, tried) in EulerOrder::ALL.into_iter().zip(&mut self.tried) {
            let angles = order.decompose(rotation, tried.angles);
            if let Some(before) = tried.angles {
                let steps = angles.iter().zip(before).map(|(angle, before)| (angle - before).abs());
                tried.largest_step = steps.fold(tried.largest_step, f64::max);
            }
            tried.angles = Some(angles);
        }
    }

    /// The order to write; the usual one where none was tried.
    pub(in crate::formats) fn best(&self) -> EulerOrder {
        let tried = || EulerOrder::ALL.into_iter().zip(&self.tried);
        let usual = tried().find(|(order, _)| *order == self.usual).map_or(0.0, |(_, tried)| tried.largest_step);
        let steadiest = tried().min_by(|first, second| first.1.largest_step.total_cmp(&second.1.largest_step));
        steadiest.filter(|(_, tried)| tried.largest_step < WORTH_IT * usual).map_or(self.usual, |(order, _)| order)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn angles_give_the_rotation_back(
            a in -PI..PI, b in -PI..PI, c in -PI..PI, before in prop::array::uniform3(-10.0..10.0_f64)
        ) {
            for order in EulerOrder::ALL {
                let rotation = order.compose([a, b, c]);
                for previous in [None, Some(before)] {
                    let back = order.compose(order.decompose(rotation, previous));
                    let error = (back - rotation).length().min((back + rotation).length());
                    prop_assert!(error < 1e-6, "{order:?} {previous:?}: {error}");
                }
            }
        }
    }

    #[test]
    fn several_turns_about_one_axis_stay_continuous() {
        for order in EulerOrder::ALL {
            for axis in 0..3 {
                let mut previous = None;
                for frame in 0..400 {
                    let mut angles = [0.0; 3];
                    angles[axis] = f64::from(frame) * 0.05;
                    let found = order.decompose(order.compose(angles), previous);
                    let step = previous.map_or(0.0, |previous| distance(found, previous).sqrt());
                    assert!(step < 0.06, "{order:?}, axis {axis}, frame {frame}: a step of {step}");
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

    #[test]
    fn a_steady_spin_is_written_in_an_order_that_is_steady_too() {
        // A small circle about the gimbal of ZXY: the outer two angles go all the way round with it.
        let spin = |frame: i32| {
            let angle = f64::from(frame) * 0.2;
            DQuat::from_rotation_x(PI / 2.0) * DQuat::from_scaled_axis(DVec3::new(angle.cos(), 0.0, angle.sin()) * 0.05)
        };
        let mut choice = OrderChoice::new(EulerOrder::ZXY);
        (0..200).for_each(|frame| choice.look(spin(frame)));
        assert!(choice.is_in_doubt(), "it is all about the gimbal");
        (0..200).for_each(|frame| choice.try_all(spin(frame)));
        let step = |order: EulerOrder| {
            let mut before = None;
            let mut largest: f64 = 0.0;
            for frame in 0..200 {
                let angles = order.decompose(spin(frame), before);
                largest = before.map_or(largest, |before| largest.max(distance(angles, before).sqrt()));
                before = Some(angles);
            }
            largest
        };
        let (best, usual) = (step(choice.best()), step(EulerOrder::ZXY));
        assert!(best < 0.02 && usual > 0.1, "{:?}: {best} a frame, ZXY {usual}", choice.best());
        let mut calm = OrderChoice::new(EulerOrder::ZXY);
        (0..200).for_each(|frame| calm.look(DQuat::from_rotation_z(f64::from(frame))));
        assert!(!calm.is_in_doubt() && calm.best() == EulerOrder::ZXY, "what is fine stays as it is");
    }

    #[test]
    fn orders_have_names() {
        assert_eq!(EulerOrder::from_name("zxy"), Some(EulerOrder::ZXY));
        assert_eq!((EulerOrder::from_name("zxz"), EulerOrder::ZYX.name()), (None, "ZYX".to_owned()));
    }
}
