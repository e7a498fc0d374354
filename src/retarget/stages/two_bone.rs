//! A limb of two bones reaches for a goal.

use glam::{DQuat, DVec3};

use crate::model::rotation::{signed_angle, smootherstep};

/// Below this sine of the bend, the plane of the limb is not taken from where its joints are but from its hinge. What of the bend is
/// not about the hinge counts only beyond another sine: a knee that is off to a side by a little is a matter of proportions.
const SURE_SINE: f64 = 0.1;
const SIDE_SINE: f64 = 0.4;
/// A limb whose plane is off the hinge's by more than this cosine says is bent neither forward nor backward.
const SIDE_COSINE: f64 = 0.5;
/// A limb whose bend changes by less than this share of it stays in its plane, however straight it is.
const LITTLE_CHANGE: f64 = 0.5;
/// Bends beyond this are not hyperextended any more, whatever the limb was before; radians.
const SURE_BEND: f64 = 0.25;

/// The share of its length by which a limb may miss its goal for the sake of a bend that changes smoothly.
const LITTLE_OFF: f64 = 0.003;

/// A limb and what it reaches for, in one space.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct TwoBone {
    /// Hip or shoulder.
    pub(in crate::retarget) start: DVec3,
    /// Knee or elbow.
    pub(in crate::retarget) middle: DVec3,
    /// Ankle or wrist.
    pub(in crate::retarget) end: DVec3,
    /// The axis about which the lower bone turns when the limb bends; unit length. Decides where the limb is straight.
    pub(in crate::retarget) hinge: DVec3,
    /// Where the end should be.
    pub(in crate::retarget) goal: DVec3,
    /// Share of the length over which the limb approaches being straight.
    pub(in crate::retarget) softness: f64,
    /// The share of its length that the limb may always reach, however soft it is: what it has without this solver.
    pub(in crate::retarget) extension: f64,
    /// The largest factor on both bones.
    pub(in crate::retarget) stretch: f64,
    /// By how much the bend should change, in radians, where something else than the goal says that too. It counts as far as the end
    /// then misses the goal by little.
    pub(in crate::retarget) change: Option<f64>,
    /// The axis about which the limb bends near this frame, where that is known from other frames; unit length. It is taken instead
    /// of the hinge where the limb is nearly straight.
    pub(in crate::retarget) near_axis: Option<DVec3>,
}

/// What brings the end to its goal: `bend` turns the lower bone about the middle joint, then `aim` turns the whole limb about
/// its start.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Reach {
    pub(in crate::retarget) bend: DQuat,
    pub(in crate::retarget) aim: DQuat,
    /// The axis of `bend`; unit length.
    pub(in crate::retarget) axis: DVec3,
    /// By how much the bend changes about it, in radians.
    pub(in crate::retarget) change: f64,
    /// Factor on both bones.
    pub(in crate::retarget) stretch: f64,
    /// Where the middle and the end are afterwards.
    pub(in crate::retarget) middle: DVec3,
    pub(in crate::retarget) end: DVec3,
}

impl TwoBone {
    /// Exact where the goal is within reach; else the end is on the line to the goal. Never NaN; continuous in the goal but for
    /// goals on the start itself.
    pub(in crate::retarget) fn solve(&self) -> Reach {
        let (upper, lower) = (self.middle - self.start, self.end - self.middle);
        let (a, b) = (upper.length(), lower.length());
        let wanted = self.goal - self.start;
        if a <= 0.0 || b <= 0.0 || !wanted.is_finite() {
            return self.as_it_is();
        }
        let distance = wanted.length();
        // It begins to be softened where the limb ceases to be free, and there without a corner: legs pass it in every step.
        let softness = self.softness.min(1.0 - self.extension).max(0.0);
        let allowed = soft(distance, a + b, softness);
        let stretch = if allowed > 0.0 { (distance / allowed).clamp(1.0, self.stretch.max(1.0)) } else { 1.0 };
        let reach = allowed.clamp((a - b).abs(), a + b);
        let axis = self.bend_axis(upper, lower, bend_of(reach, a, b, b));
        // What of the lower bone turns about the axis; all of it, where the axis is the normal of the limb's plane.
        let turning = (lower - axis * lower.dot(axis)).length();
        let now = signed_angle(upper, lower, axis);
        let exact =
            relaxed(bend_of(reach, a, b, turning), now, smootherstep(self.along_hinge(upper, axis) / SIDE_COSINE))
                - now;
        let change = self.change.map_or(exact, |wanted| near_exact([a, b, turning], now, exact, wanted));
        let bend = DQuat::from_axis_angle(axis, change);
        let bent = upper + bend * lower;
        let aim = arc(bent, wanted, axis);
        let middle = self.start + aim * upper * stretch;
        Reach { bend, aim, axis, change, stretch, middle, end: self.start + aim * bent * stretch }
    }

    fn as_it_is(&self) -> Reach {
        let (middle, end) = (self.middle, self.end);
        let (bend, aim, axis) = (DQuat::IDENTITY, DQuat::IDENTITY, self.hinge);
        Reach { bend, aim, axis, change: 0.0, stretch: 1.0, middle, end }
    }

    /// The hinge at a right angle to the upper bone; any such axis where the hinge is along it.
    fn hinge_across(&self, upper: DVec3) -> DVec3 {
        across(self.hinge, upper).unwrap_or_else(|| upper.normalize_or_zero().any_orthonormal_vector())
    }

    /// The cosine between the hinge and an axis.
    fn along_hinge(&self, upper: DVec3, axis: DVec3) -> f64 {
        self.hinge_across(upper).dot(axis)
    }

    /// The normal of the limb's plane, on the side of the axis about which it bends near this frame, or of the hinge; that axis itself where the
    /// limb is nearly straight and its bend is to change.
    fn bend_axis(&self, upper: DVec3, lower: DVec3, wanted_bend: f64) -> DVec3 {
        let usual = self.near_axis.and_then(|axis| across(axis, upper)).unwrap_or_else(|| self.hinge_across(upper));
        let normal = upper.cross(lower) / (upper.length() * lower.length());
        let sine = normal.length();
        let normal = if normal.dot(usual) < 0.0 { -normal } else { normal };
        let change = wanted_bend - sine.atan2(upper.dot(lower) / (upper.length() * lower.length()));
        let little = (LITTLE_CHANGE * sine).max(f64::MIN_POSITIVE);
        let bend = normal.dot(usual).max(sine - SIDE_SINE);
        let sure = match self.near_axis {
            Some(_) => smootherstep((bend - SURE_SINE) / SURE_BEND),
            None => smootherstep(bend / SURE_SINE),
        };
        let sure = sure.max(1.0 - smootherstep(change.abs() / little));
        (normal.normalize_or_zero() * sure + usual * (1.0 - sure)).normalize_or(usual)
    }

    /// The normal of the limb's plane as far as it bends about the hinge: its length is the sine of that bend, and 0 for a limb that is
    /// bent the other way.
    pub(in crate::retarget) fn forward_normal(&self) -> DVec3 {
        let (upper, lower) = (self.middle - self.start, self.end - self.middle);
        let normal = upper.normalize_or_zero().cross(lower.normalize_or_zero());
        if normal.dot(self.hinge_across(upper)) > 0.0 { normal } else { DVec3::ZERO }
    }
}

/// An axis at a right angle to a bone; nothing where it is along it.
fn across(axis: DVec3, bone: DVec3) -> Option<DVec3> {
    let direction = bone.normalize_or_zero();
    (axis - direction * axis.dot(direction)).try_normalize()
}

/// The bend to take, where the limb is bent by `now` about the hinge and should be by `wanted`: the same, but a limb that is bent
/// backward a little stays so while it is nearly straight, and one that is bent backward a lot is meant to be: the legs of birds and
/// robots, and rigs whose rest pose says nothing about the hinge. So is one whose plane is across the hinge's (`aligned` is 0): then the
/// sign of the bend says nothing.
fn relaxed(wanted: f64, now: f64, aligned: f64) -> f64 {
    if now >= 0.0 {
        return wanted;
    }
    let backward = -now;
    let fade = 1.0 - smootherstep((wanted - backward) / SURE_BEND);
    let forward = wanted - 2.0 * backward.min(wanted) * fade;
    let is_meant = 1.0 - (1.0 - smootherstep((backward - SURE_BEND) / SURE_BEND)) * aligned;
    forward + (-wanted - forward) * is_meant
}

/// The bend at which the ends of bones of lengths `a` and `b` are so far apart, when so much of `b` turns about the axis of the bend; the
/// nearest there is where none is (law of cosines).
fn bend_of(reach: f64, a: f64, b: f64, turning: f64) -> f64 {
    ((reach * reach - a * a - b * b) / (2.0 * a * turning).max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0).acos()
}

/// A change of the bend between the exact one and another one that is wanted: the latter as far as the distance from start to end,
/// of bones of these lengths, is then off by less than [`LITTLE_OFF`]. The third length is what of the lower bone turns.
fn near_exact([a, b, turning]: [f64; 3], now: f64, exact: f64, wanted: f64) -> f64 {
    let reach = |change: f64| (a * a + b * b + 2.0 * a * turning * (now + change).cos()).max(0.0).sqrt();
    let off = (reach(wanted) - reach(exact)).abs() / (LITTLE_OFF * (a + b));
    let share = if off > f64::EPSILON { off.tanh() / off } else { 1.0 };
    exact + (wanted - exact) * share
}

/// `d` up to `length − width`; from there on it comes ever nearer to `length`, with a continuous slope.
pub(in crate::retarget) fn soft(distance: f64, length: f64, softness: f64) -> f64 {
    let width = softness * length;
    let begin = length - width;
    if width <= 0.0 {
        return distance.min(length);
    }
    if distance <= begin { distance } else { length - width * (-(distance - begin) / width).exp() }
}

/// 0 below 0, 1 above 1, and smooth between.
/// The shortest rotation between two directions; half a turn about `axis` where they are opposite, nothing where one has no
/// length.
pub(in crate::retarget) fn arc(from: DVec3, to: DVec3, axis: DVec3) -> DQuat {
    let (Some(from), Some(to)) = (from.try_normalize(), to.try_normalize()) else { return DQuat::IDENTITY };
    let turn = DQuat::from_xyzw(0.0, 0.0, 0.0, 1.0 + from.dot(to));
    let cross = from.cross(to);
    let turn = DQuat::from_xyzw(cross.x, cross.y, cross.z, turn.w);
    if turn.length_squared() < 1e-24 { DQuat::from_axis_angle(axis, std::f64::consts::PI) } else { turn.normalize() }
}

#[cfg(test)]
mod tests;
