//! How high a foot is above the floor, whatever way it is turned.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use crate::retarget::stages::posing::Pose;

use super::sole::{Along, Sole, Turned};

/// Beyond this tilt, in radians, points of the sole may be behind the ankle that are before it in a foot that stands.
const UPSIDE_DOWN: f64 = 1.0;

/// Slots of a foot in a posing.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FootSlots {
    pub(in crate::retarget) end: usize,
    pub(in crate::retarget) ball: Option<usize>,
    pub(in crate::retarget) shin: usize,
}

/// Where ankle and joint of the ball are, and how they are turned.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PlacedFoot {
    pub(in crate::retarget) end: (DVec3, DQuat),
    pub(in crate::retarget) ball: Option<(DVec3, DQuat)>,
    /// How the shin is turned.
    pub(in crate::retarget) shin: DQuat,
}

/// Heights of the lowest points of a foot.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Lowest {
    /// Of those that bending the toes does not lift.
    pub(in crate::retarget) firm: f64,
    pub(in crate::retarget) all: f64,
}

/// A foot that is tilted, seen along the axis about which it would be set flat.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Tilted {
    /// Horizontal; unit length.
    pub(in crate::retarget) axis: DVec3,
    /// Radians.
    pub(in crate::retarget) angle: f64,
}

impl Tilted {
    /// Of what has this normal where it should have `up`.
    pub(in crate::retarget) fn of(normal: DVec3, up: DVec3) -> Option<Self> {
        let axis = normal.cross(up);
        let angle = axis.length().atan2(normal.dot(up));
        Some(Self { axis: axis.try_normalize()?, angle })
    }

    /// The angle by which a point has to be turned, so far above the ankle and before the axis, to be so far above it; nothing where
    /// turning does not lift it.
    fn needed(&self, above: f64, before: f64, wanted: f64) -> Option<f64> {
        // A foot that points down, or beyond, passes the vertical first.
        let is_upside_down = self.angle > UPSIDE_DOWN && above < wanted.min(0.0);
        let reach = (above * above + before * before).sqrt();
        if reach <= 0.0 || (before <= 0.0 && !is_upside_down) {
            return None;
        }
        let now = before.atan2(above) + if before < 0.0 { TAU } else { 0.0 };
        Some(now - (wanted / reach).clamp(-1.0, 1.0).acos())
    }
}

impl PlacedFoot {
    /// As it is in a pose.
    #[inline(always)]
    pub(in crate::retarget) fn posed(slots: FootSlots, pose: &Pose) -> Self {
        let place = |slot: usize| (pose.model[slot].translation, pose.model[slot].rotation);
        Self { end: place(slots.end), ball: slots.ball.map(place), shin: pose.model[slots.shin].rotation }
    }

    /// The same foot with its ankle elsewhere. Where the shin will be is not known yet; it is turned as it is.
    #[inline(always)]
    pub(in crate::retarget) fn moved_to(&self, position: DVec3, rotation: DQuat) -> Self {
        let turn = rotation * self.end.1.conjugate();
        let ball = self.ball.map(|(place, turned)| (position + turn * (place - self.end.0), turn * turned));
        Self { end: (position, rotation), ball, shin: self.shin }
    }

    /// A direction in the axes of what the points of the foot move with.
    #[inline(always)]
    fn along(&self, direction: DVec3) -> Along {
        let toes =
            |(ball, turned): (DVec3, DQuat)| ((ball - self.end.0).dot(direction), turned.conjugate() * direction);
        Along { of_end: self.end.1.conjugate() * direction, of_ball: self.ball.map_or((0.0, DVec3::ZERO), toes) }
    }

    /// Heights of its lowest points.
    #[inline(always)]
    pub(in crate::retarget) fn lowest(&self, sole: &Sole, up: DVec3) -> Lowest {
        let [firm, all] = sole.lowest(&self.along(up), self.shin.conjugate() * up);
        let ankle = self.end.0.dot(up);
        Lowest { firm: ankle + firm, all: ankle + all }
    }

    /// How far the farthest point is from the ankle along a direction.
    pub(in crate::retarget) fn farthest_before(&self, sole: &Sole, direction: DVec3) -> f64 {
        sole.farthest(&self.along(direction))
    }

    /// The angle by which the foot has to be turned toward flat about its ankle until the lowest of its points is at a height: negative
    /// where it is above that. At least `least`, and at most until it is flat. A point that toes lift turns the foot no farther than
    /// `limit`.
    ///
    /// A point that is `a` above the ankle and `b` before the axis is `a · cos θ + b · sin θ` above it when turned by θ; only those
    /// before the axis are lifted.
    #[inline(always)]
    pub(in crate::retarget) fn turn_to(
        &self,
        sole: &Sole,
        up: DVec3,
        tilted: &Tilted,
        height: f64,
        least: f64,
        limit: f64,
    ) -> f64 {
        let directions = [self.along(up), self.along(up.cross(tilted.axis))];
        let of_shin = self.shin.conjugate() * up;
        let wanted = height - self.end.0.dot(up);
        let mut turn = least;
        let (mut sine, mut cosine) = turn.sin_cos();
        for (of_yielding, limit) in [(false, f64::INFINITY), (true, limit)] {
            if limit <= turn {
                continue;
            }
            for Turned { above, before, wanted } in sole.turned(of_yielding, directions, of_shin, wanted) {
                for ((a, b), wanted) in above.into_iter().zip(before).zip(wanted) {
                    // Most points are high enough after the turn that others need; the slope says whether more of it lifts them.
                    if a * cosine + b * sine >= wanted && b * cosine >= a * sine {
                        continue;
                    }
                    let needed = tilted.needed(a, b, wanted).map_or(turn, |needed| needed.min(limit));
                    if needed > turn {
                        turn = needed;
                        (sine, cosine) = turn.sin_cos();
                    }
                }
            }
        }
        turn.min(tilted.angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::{FootShape, SupportPoint};

    const ANKLE: f64 = 0.1;

    /// A flat sole from 7 cm behind the ankle to 23 cm before it, 10 cm below.
    fn shape() -> FootShape {
        let point = |z: f64| SupportPoint {
            from_end: DVec3::new(0.0, -ANKLE, z),
            from_ball: DVec3::ZERO,
            from_shin: DVec3::ZERO,
            toes: 0.0,
            shin: 0.0,
            radius: 0.0,
            gives_way: false,
        };
        FootShape { points: vec![point(-0.07), point(0.23)], ..FootShape::default() }
    }

    fn sole(shape: &FootShape) -> Sole {
        Sole::new(shape, true)
    }

    /// The toes are down by so many degrees.
    fn foot(height: f64, degrees: f64) -> PlacedFoot {
        let turned = DQuat::from_rotation_x(degrees.to_radians());
        PlacedFoot { end: (DVec3::Y * height, turned), ball: None, shin: DQuat::IDENTITY }
    }

    fn lowest(foot: &PlacedFoot) -> f64 {
        foot.lowest(&sole(&shape()), DVec3::Y).all
    }

    #[test]
    fn a_tilted_foot_turns_until_its_lowest_point_is_where_it_should_be() {
        for (height, degrees, wanted) in [(0.15, 40.0, 0.0), (0.15, 40.0, -0.05), (0.12, -30.0, 0.0), (0.15, 95.0, 0.0)]
        {
            let foot = foot(height, degrees);
            let tilted = Tilted::of(foot.end.1 * DVec3::Y, DVec3::Y).expect("it is tilted");
            assert!((tilted.angle.to_degrees() - f64::abs(degrees)).abs() < 1e-9, "by as much as it is");
            let angle = foot.turn_to(&sole(&shape()), DVec3::Y, &tilted, wanted, f64::NEG_INFINITY, f64::INFINITY);
            let turned = DQuat::from_axis_angle(tilted.axis, angle) * foot.end.1;
            let found = lowest(&foot.moved_to(foot.end.0, turned));
            assert!((found - wanted).abs() < 1e-9, "{height} m, {degrees}°: {found} instead of {wanted}");
        }
    }

    #[test]
    fn a_foot_turns_no_farther_than_flat() {
        let foot = foot(0.05, 30.0);
        let tilted = Tilted::of(foot.end.1 * DVec3::Y, DVec3::Y).expect("it is tilted");
        let angle = foot.turn_to(&sole(&shape()), DVec3::Y, &tilted, 0.0, f64::NEG_INFINITY, f64::INFINITY);
        assert!((angle - tilted.angle).abs() < 1e-12, "the ankle is too low: {angle}");
        assert!(Tilted::of(DVec3::Y, DVec3::Y).is_none(), "a flat foot has no axis");
    }

    #[test]
    fn what_several_joints_move_lies_between() {
        let mut shape = shape();
        shape.points[1].toes = 0.5;
        shape.points[0].gives_way = true;
        shape.points[1].from_ball = DVec3::new(0.0, -0.02, 0.1);
        let ball = (DVec3::new(0.0, 0.02, 0.13), DQuat::from_rotation_x(-0.9));
        let bent = PlacedFoot { ball: Some(ball), ..foot(ANKLE, 0.0) };
        let (of_foot, of_toes) = (0.0, (ball.0 + ball.1 * shape.points[1].from_ball).y);
        let found = bent.lowest(&sole(&shape), DVec3::Y).firm;
        assert!((found - f64::midpoint(of_foot, of_toes)).abs() < 1e-12, "{found}");
        let mut shape = self::shape();
        shape.points[0].shin = 0.25;
        shape.points[0].from_shin = DVec3::new(0.0, -0.2, 0.0);
        let found = foot(ANKLE, 0.0).lowest(&sole(&shape), DVec3::Y).all;
        assert!((found + 0.025).abs() < 1e-12, "a quarter of what the shin says: {found}");
    }
}
