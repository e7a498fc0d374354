//! Rotations into three angles that change smoothly over time.
//!
//! Every rotation has two triples of angles, each repeating every full turn; the one nearest to the previous frame's is
//! taken. Where the middle axis makes the outer two coincide, only their sum is defined: the first goes on a while as it
//! went, and then stays.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec3};

use crate::model::Reporter;

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

    /// Angles in the order of the channels as angles about X, Y and Z.
    pub(in crate::formats) fn by_axis(self, angles: [f64; 3]) -> [f64; 3] {
        let mut by_axis = [0.0; 3];
        for (axis, angle) in self.0.into_iter().zip(angles) {
            by_axis[axis] = angle;
        }
        by_axis
    }

    /// The rotation of three angles in radians.
    pub(in crate::formats) fn compose(self, angles: [f64; 3]) -> DQuat {
        let turn = |position: usize| DQuat::from_axis_angle(DVec3::AXES[self.0[position]], angles[position]);
        turn(0) * turn(1) * turn(2)
    }

    /// Angles in radians that give a unit rotation, with the middle angle within a quarter turn.
    pub(in crate::formats) fn decompose(self, rotation: DQuat) -> [f64; 3] {
        self.principal(rotation).0
    }

    /// Those angles, and the cosine of the middle one.
    fn principal(self, rotation: DQuat) -> ([f64; 3], f64) {
        let matrix = DMat3::from_quat(rotation);
        let sign = self.sign();
        let [i, j, k] = self.0;
        let at = |row: usize, column: usize| matrix.col(column)[row];
        let cosine = at(i, i).hypot(at(i, j));
        let first = (-sign * at(j, k)).atan2(at(k, k));
        let middle = (sign * at(i, k)).atan2(cosine);
        let last = (-sign * at(i, j)).atan2(at(i, i));
        ([first, middle, last], cosine)
    }

    /// How near a rotation is to where the outer two axes are one: |sin| of the middle angle, 1 at the gimbal.
    fn exposure(self, rotation: DQuat) -> f64 {
        let [i, _, k] = self.0;
        DMat3::from_quat(rotation).col(k)[i].abs()
    }

    /// The angles nearest to `previous` whose first is the given one, where they still give the rotation.
    fn with_first(self, first: f64, rotation: DQuat, previous: [f64; 3]) -> Option<[f64; 3]> {
        let [i, j, k] = self.0;
        let sign = self.sign();
        let without_first = DMat3::from_quat(DQuat::from_axis_angle(DVec3::AXES[i], -first) * rotation);
        let at = |row: usize, column: usize| without_first.col(column)[row];
        let middle = (sign * at(i, k)).atan2(at(k, k));
        let last = (sign * at(j, i)).atan2(at(j, j));
        let [_, middle, last] = unwrapped([first, middle, last], previous);
        let found = [first, middle, last];
        let back = self.compose(found);
        let error = 2.0 * (back - rotation).length().min((back + rotation).length());
        (error < GIMBAL_ERROR_RADIANS).then_some(found)
    }

    /// 1 for XYZ and its rotations, −1 for the others.
    const fn sign(self) -> f64 {
        if (self.0[0] + 1) % 3 == self.0[1] { 1.0 } else { -1.0 }
    }
}

/// The angles of one joint, frame after frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::formats) struct EulerTrack {
    order: EulerOrder,
    angles: Option<[f64; 3]>,
    /// By how much the first angle goes on where nothing says by how much it does.
    drift: f64,
}

impl EulerTrack {
    pub(in crate::formats) const fn new(order: EulerOrder) -> Self {
        Self { order, angles: None, drift: 0.0 }
    }

    /// Angles in radians that give the next unit rotation, the nearest ones to those of the frame before.
    pub(in crate::formats) fn next(&mut self, rotation: DQuat) -> [f64; 3] {
        let ([first, middle, last], cosine) = self.order.principal(rotation);
        let Some(previous) = self.angles else {
            self.angles = Some([first, middle, last]);
            return [first, middle, last];
        };
        if cosine < GIMBAL_COSINE
            && let Some(found) = self.order.with_first(previous[0] + self.drift, rotation, previous)
        {
            // What passes through goes on as it went; what stays comes to rest, and noise cannot turn it.
            self.drift /= 2.0;
            self.angles = Some(found);
            return found;
        }
        let one = unwrapped([first, middle, last], previous);
        let other = unwrapped([first + PI, PI - middle, last + PI], previous);
        let found = if distance(other, previous) < distance(one, previous) { other } else { one };
        self.drift = found[0] - previous[0];
        self.angles = Some(found);
        found
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
/// The usual order is kept where it stays clear of its gimbal and its angles turn no faster than the joint does, and not very fast. Else
/// all six are tried, and the one whose largest step is the least is taken. (docs/algorithm/clips.md.)
#[derive(Clone, Debug)]
pub(in crate::formats) struct OrderChoice {
    exposure: f64,
    as_usual: Tried,
    before: Option<DQuat>,
    largest_turn: f64,
    tried: [Tried; 6],
}

/// One order as it does so far: the angles up to the last frame, and the largest step of any.
#[derive(Clone, Copy, Debug)]
struct Tried {
    track: EulerTrack,
    largest_step: f64,
}

impl Tried {
    const fn new(order: EulerOrder) -> Self {
        Self { track: EulerTrack::new(order), largest_step: 0.0 }
    }

    fn next(&mut self, rotation: DQuat) -> [f64; 3] {
        let before = self.track.angles;
        let angles = self.track.next(rotation);
        let steps = before.map(|before| angles.iter().zip(before).map(|(angle, before)| (angle - before).abs()));
        self.largest_step = steps.into_iter().flatten().fold(self.largest_step, f64::max);
        angles
    }
}

/// Sine of the middle angle from which the outer two turn several times as fast as the joint does.
const NEAR_GIMBAL: f64 = 0.9;
/// Steps of angles below this, in radians, are none to speak of.
const SMALL_STEP: f64 = 0.2;
/// Steps of angles above this, in radians, are jumps to whoever edits them, however fast the joint turns.
const JUMP: f64 = 0.5;
/// Another order has to be better than the usual one by this factor, where that one does not jump.
const WORTH_IT: f64 = 0.95;
/// What is better by less is rounding.
const NOT_ROUNDING: f64 = 0.999;

impl OrderChoice {
    pub(in crate::formats) fn new(usual: EulerOrder) -> Self {
        Self {
            exposure: 0.0,
            as_usual: Tried::new(usual),
            before: None,
            largest_turn: 0.0,
            tried: EulerOrder::ALL.map(Tried::new),
        }
    }

    /// Looks at the next frame. Gives its angles in the usual order, as an [`EulerTrack`] of that order would.
    pub(in crate::formats) fn look(&mut self, rotation: DQuat) -> [f64; 3] {
        self.exposure = self.exposure.max(self.as_usual.track.order.exposure(rotation));
        let turn = self.before.map_or(0.0, |before| before.angle_between(rotation));
        self.largest_turn = self.largest_turn.max(turn);
        self.before = Some(rotation);
        self.as_usual.next(rotation)
    }

    /// Whether another order may do better than the usual one for the frames that were looked at.
    pub(in crate::formats) fn is_in_doubt(&self) -> bool {
        let step = self.as_usual.largest_step;
        self.exposure > NEAR_GIMBAL || step > JUMP || (step > SMALL_STEP && self.largest_turn < WORTH_IT * step)
    }

    /// Tries all orders on the next frame.
    pub(in crate::formats) fn try_all(&mut self, rotation: DQuat) {
        for tried in &mut self.tried {
            tried.next(rotation);
        }
    }

    /// The order to write; the usual one where none was tried.
    pub(in crate::formats) fn best(&self) -> EulerOrder {
        let usual = self.as_usual.largest_step;
        let steadiest = self.tried.iter().min_by(|first, second| first.largest_step.total_cmp(&second.largest_step));
        let was_tried = |tried: &&Tried| tried.track.angles.is_some();
        let most = if usual > JUMP { NOT_ROUNDING * usual } else { WORTH_IT * usual };
        let better = steadiest.filter(was_tried).filter(|tried| tried.largest_step < most);
        better.unwrap_or(&self.as_usual).track.order
    }
}

/// Joints whose rotations are not in the usual order, as a warning lists them.
pub(in crate::formats) fn report_orders(
    usual: EulerOrder,
    place: &str,
    orders: impl Iterator<Item = (String, EulerOrder)>,
    reporter: &mut Reporter,
) {
    const MAX: usize = 8;
    let others: Vec<String> = orders
        .filter(|(_, order)| *order != usual)
        .map(|(joint, order)| format!("'{joint}' {}", order.name()))
        .collect();
    if others.is_empty() {
        return;
    }
    let more = others.len().saturating_sub(MAX);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    reporter.warn(
        "rotation_order_chosen",
        place,
        format!(
            "joints that turn through the gimbal of {} have their rotations in other orders: {}{more}",
            usual.name(),
            others[..others.len().min(MAX)].join(", ")
        ),
        "set output.rotation_order to have all joints in one order",
    );
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
                for angles in [None, Some(before)] {
                    let back = order.compose(EulerTrack { angles, ..EulerTrack::new(order) }.next(rotation));
                    let error = (back - rotation).length().min((back + rotation).length());
                    prop_assert!(error < 1e-6, "{order:?} {angles:?}: {error}");
                }
            }
        }
    }

    /// The largest change of all three angles at once from frame to frame.
    fn largest_step(order: EulerOrder, rotations: impl Iterator<Item = DQuat>) -> f64 {
        let mut track = EulerTrack::new(order);
        let angles: Vec<[f64; 3]> = rotations.map(|rotation| track.next(rotation)).collect();
        angles.windows(2).map(|pair| distance(pair[0], pair[1]).sqrt()).fold(0.0, f64::max)
    }

    #[test]
    fn several_turns_about_one_axis_stay_continuous() {
        for order in EulerOrder::ALL {
            for axis in 0..3 {
                let turn = |frame: i32| {
                    let mut angles = [0.0; 3];
                    angles[axis] = f64::from(frame) * 0.05;
                    order.compose(angles)
                };
                let step = largest_step(order, (0..400).map(turn));
                assert!(step < 0.06, "{order:?}, axis {axis}: a step of {step}");
            }
        }
    }

    #[test]
    fn what_passes_through_the_gimbal_goes_on_as_it_went() {
        // All three turn at once, and the middle one is at a right angle exactly in frame 30, and in frame 90 and so on.
        let step = PI / 60.0;
        for order in EulerOrder::ALL {
            let turn = |frame: i32| order.compose([2.0, 1.0, -1.5].map(|rate| rate * f64::from(frame) * step));
            let found = largest_step(order, (0..400).map(turn));
            let own = step * (4.0_f64 + 1.0 + 2.25).sqrt();
            assert!(found < own + 1e-5, "{order:?}: a step of {found}, {own} went in");
        }
    }

    #[test]
    fn noise_at_the_gimbal_does_not_spin_the_outer_axes() {
        let order = EulerOrder::ZXY;
        let noisy = |frame: i32| {
            let noise = if frame % 2 == 0 { 1e-7 } else { -1e-7 };
            order.compose([0.3, PI / 2.0, 0.1]) * DQuat::from_rotation_x(noise)
        };
        let before = order.compose([0.3, PI / 2.0 - 0.02, 0.1]);
        let step = largest_step(order, std::iter::once(before).chain((0..100).map(noisy)));
        assert!(step < 0.03, "a step of {step} radians");
    }

    #[test]
    fn a_steady_spin_is_written_in_an_order_that_is_steady_too() {
        // A small circle about the gimbal of ZXY: the outer two angles go all the way round with it.
        let spin = |frame: i32| {
            let angle = f64::from(frame) * 0.2;
            DQuat::from_rotation_x(PI / 2.0) * DQuat::from_scaled_axis(DVec3::new(angle.cos(), 0.0, angle.sin()) * 0.05)
        };
        let mut choice = OrderChoice::new(EulerOrder::ZXY);
        (0..200).for_each(|frame| {
            choice.look(spin(frame));
        });
        assert!(choice.is_in_doubt(), "it is all about the gimbal");
        (0..200).for_each(|frame| choice.try_all(spin(frame)));
        let step = |order: EulerOrder| largest_step(order, (0..200).map(spin));
        let (best, usual) = (step(choice.best()), step(EulerOrder::ZXY));
        assert!(best < 0.02 && usual > 0.1, "{:?}: {best} a frame, ZXY {usual}", choice.best());
        let mut calm = OrderChoice::new(EulerOrder::ZXY);
        (0..200).for_each(|frame| {
            calm.look(DQuat::from_rotation_z(f64::from(frame) * 0.4));
        });
        assert!(!calm.is_in_doubt() && calm.best() == EulerOrder::ZXY, "what is fine stays as it is");
        let mut fast = OrderChoice::new(EulerOrder::ZXY);
        let turn = |frame: i32| DQuat::from_rotation_z(f64::from(frame));
        (0..200).for_each(|frame| {
            fast.look(turn(frame));
        });
        assert!(fast.is_in_doubt(), "a radian a frame may be less in another order");
        (0..200).for_each(|frame| fast.try_all(turn(frame)));
        assert_eq!(fast.best(), EulerOrder::ZXY, "and is not");
    }

    #[test]
    fn orders_have_names() {
        assert_eq!(EulerOrder::from_name("zxy"), Some(EulerOrder::ZXY));
        assert_eq!((EulerOrder::from_name("zxz"), EulerOrder::ZYX.name()), (None, "ZYX".to_owned()));
    }
}
