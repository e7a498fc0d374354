//! How high a foot is above the floor, whatever way it is turned.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use crate::retarget::stages::posing::Pose;
use crate::rig::{FootShape, SupportPoint};

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
    /// Of those that are asked for.
    pub(in crate::retarget) wanted: f64,
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
}

impl PlacedFoot {
    /// As it is in a pose.
    pub(in crate::retarget) fn posed(slots: FootSlots, pose: &Pose) -> Self {
        let place = |slot: usize| (pose.model[slot].translation, pose.model[slot].rotation);
        Self { end: place(slots.end), ball: slots.ball.map(place), shin: pose.model[slots.shin].rotation }
    }

    /// The same foot with its ankle elsewhere. Where the shin will be is not known yet; it is turned as it is.
    pub(in crate::retarget) fn moved_to(&self, position: DVec3, rotation: DQuat) -> Self {
        let turn = rotation * self.end.1.conjugate();
        let ball = self.ball.map(|(place, turned)| (position + turn * (place - self.end.0), turn * turned));
        Self { end: (position, rotation), ball, shin: self.shin }
    }

    /// What the part of a point that moves with foot and toes measures along a direction, from the ankle.
    fn along(&self, direction: DVec3) -> impl Fn(&SupportPoint) -> f64 + use<> {
        let of_end = self.end.1.conjugate() * direction;
        let toes = self.ball.map(|(ball, turned)| ((ball - self.end.0).dot(direction), turned.conjugate() * direction));
        move |point| {
            let end = of_end.dot(point.from_end);
            let Some((ball, of_ball)) = toes.filter(|_| point.toes > 0.0) else { return end };
            end + (ball + of_ball.dot(point.from_ball) - end) * (point.toes / (1.0 - point.shin))
        }
    }

    /// Height of the lowest of the points.
    pub(in crate::retarget) fn lowest(&self, shape: &FootShape, up: DVec3) -> f64 {
        self.lowest_of(shape, up, |_| true).all
    }

    /// Heights of the lowest of the points that are wanted, and of the lowest of all.
    pub(in crate::retarget) fn lowest_of(
        &self,
        shape: &FootShape,
        up: DVec3,
        is_wanted: impl Fn(&SupportPoint) -> bool,
    ) -> Lowest {
        let (of_foot, of_shin) = (self.along(up), self.shin.conjugate() * up);
        let mut lowest = Lowest { wanted: f64::INFINITY, all: f64::INFINITY };
        for point in &shape.points {
            let foot = of_foot(point);
            let of_joints =
                if point.shin > 0.0 { foot + (of_shin.dot(point.from_shin) - foot) * point.shin } else { foot };
            let height = of_joints - point.radius;
            lowest.all = lowest.all.min(height);
            if is_wanted(point) {
                lowest.wanted = lowest.wanted.min(height);
            }
        }
        let ankle = self.end.0.dot(up);
        Lowest { wanted: ankle + lowest.wanted, all: ankle + lowest.all }
    }

    /// How far the farthest point is from the ankle along a direction.
    pub(in crate::retarget) fn farthest_before(&self, shape: &FootShape, direction: DVec3) -> f64 {
        shape.points.iter().map(self.along(direction)).fold(0.0, f64::max)
    }

    /// The angle by which the foot has to be turned toward flat about its ankle until the lowest of its points is at a height: negative
    /// where it is above that. At least `least`, and at most until it is flat. A point turns the foot no farther than `limit` says.
    ///
    /// A point that is `a` above the ankle and `b` before the axis is `a · cos θ + b · sin θ` above it when turned by θ; only those
    /// before the axis are lifted.
    pub(in crate::retarget) fn turn_to(
        &self,
        shape: &FootShape,
        up: DVec3,
        tilted: &Tilted,
        height: f64,
        least: f64,
        limit: impl Fn(&SupportPoint) -> f64,
    ) -> f64 {
        let (above, before) = (self.along(up), self.along(up.cross(tilted.axis)));
        let of_shin = self.shin.conjugate() * up;
        let wanted = height - self.end.0.dot(up);
        let mut turn = least;
        let (mut sine, mut cosine) = turn.sin_cos();
        for point in &shape.points {
            let limit = limit(point);
            if limit <= turn {
                continue;
            }
            // What moves with the shin stays.
            let wanted = (wanted + point.radius - of_shin.dot(point.from_shin) * point.shin) / (1.0 - point.shin);
            let (a, b) = (above(point), before(point));
            // Most points are high enough after the turn that others need; the slope says whether more of it lifts them.
            if a * cosine + b * sine >= wanted && b * cosine >= a * sine {
                continue;
            }
            // A foot that points down, or beyond, passes the vertical first.
            let is_upside_down = tilted.angle > UPSIDE_DOWN && a < wanted.min(0.0);
            let reach = (a * a + b * b).sqrt();
            if reach <= 0.0 || (b <= 0.0 && !is_upside_down) {
                continue;
            }
            let now = if b < 0.0 { b.atan2(a) + TAU } else { b.atan2(a) };
            let needed = (now - (wanted / reach).clamp(-1.0, 1.0).acos()).min(limit);
            if needed > turn {
                turn = needed;
                (sine, cosine) = turn.sin_cos();
            }
        }
        turn.min(tilted.angle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// The toes are down by so many degrees.
    fn foot(height: f64, degrees: f64) -> PlacedFoot {
        let turned = DQuat::from_rotation_x(degrees.to_radians());
        PlacedFoot { end: (DVec3::Y * height, turned), ball: None, shin: DQuat::IDENTITY }
    }

    fn lowest(foot: &PlacedFoot) -> f64 {
        foot.lowest(&shape(), DVec3::Y)
    }

    #[test]
    fn a_tilted_foot_turns_until_its_lowest_point_is_where_it_should_be() {
        for (height, degrees, wanted) in [(0.15, 40.0, 0.0), (0.15, 40.0, -0.05), (0.12, -30.0, 0.0), (0.15, 95.0, 0.0)]
        {
            let foot = foot(height, degrees);
            let tilted = Tilted::of(foot.end.1 * DVec3::Y, DVec3::Y).expect("it is tilted");
            assert!((tilted.angle.to_degrees() - f64::abs(degrees)).abs() < 1e-9, "by as much as it is");
            let angle = foot.turn_to(&shape(), DVec3::Y, &tilted, wanted, f64::NEG_INFINITY, |_| f64::INFINITY);
            let turned = DQuat::from_axis_angle(tilted.axis, angle) * foot.end.1;
            let found = lowest(&foot.moved_to(foot.end.0, turned));
            assert!((found - wanted).abs() < 1e-9, "{height} m, {degrees}°: {found} instead of {wanted}");
        }
    }

    #[test]
    fn a_foot_turns_no_farther_than_flat() {
        let foot = foot(0.05, 30.0);
        let tilted = Tilted::of(foot.end.1 * DVec3::Y, DVec3::Y).expect("it is tilted");
        let angle = foot.turn_to(&shape(), DVec3::Y, &tilted, 0.0, f64::NEG_INFINITY, |_| f64::INFINITY);
        assert!((angle - tilted.angle).abs() < 1e-12, "the ankle is too low: {angle}");
        assert!(Tilted::of(DVec3::Y, DVec3::Y).is_none(), "a flat foot has no axis");
    }

    #[test]
    fn what_several_joints_move_lies_between() {
        let mut shape = shape();
        shape.points[1].toes = 0.5;
        shape.points[1].from_ball = DVec3::new(0.0, -0.02, 0.1);
        let ball = (DVec3::new(0.0, 0.02, 0.13), DQuat::from_rotation_x(-0.9));
        let bent = PlacedFoot { ball: Some(ball), ..foot(ANKLE, 0.0) };
        let (of_foot, of_toes) = (0.0, (ball.0 + ball.1 * shape.points[1].from_ball).y);
        let found = bent.lowest_of(&shape, DVec3::Y, |point| point.toes > 0.0).wanted;
        assert!((found - f64::midpoint(of_foot, of_toes)).abs() < 1e-12, "{found}");
        let mut shape = self::shape();
        shape.points[0].shin = 0.25;
        shape.points[0].from_shin = DVec3::new(0.0, -0.2, 0.0);
        let found = foot(ANKLE, 0.0).lowest(&shape, DVec3::Y);
        assert!((found + 0.025).abs() < 1e-12, "a quarter of what the shin says: {found}");
    }
}
