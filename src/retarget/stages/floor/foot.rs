//! How high a foot is above the floor, whatever way it is turned.

use glam::{DQuat, DVec3};

use super::super::posing::Pose;
use crate::rig::{FootShape, SupportPoint};

/// Slots of a foot in a posing.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct FootSlots {
    pub(in super::super) end: usize,
    pub(in super::super) ball: Option<usize>,
}

/// Where ankle and joint of the ball are, and how they are turned.
#[derive(Clone, Copy, Debug)]
pub(in super::super) struct PlacedFoot {
    pub(in super::super) end: (DVec3, DQuat),
    pub(in super::super) ball: Option<(DVec3, DQuat)>,
}

/// A foot that is tilted, seen along the axis about which it would be set flat.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tilted {
    /// Horizontal; unit length.
    pub(super) axis: DVec3,
    /// Radians.
    pub(super) angle: f64,
}

impl PlacedFoot {
    /// As it is in a pose.
    pub(in super::super) fn posed(slots: FootSlots, pose: &Pose) -> Self {
        let place = |slot: usize| (pose.model[slot].translation, pose.model[slot].rotation);
        Self { end: place(slots.end), ball: slots.ball.map(place) }
    }

    /// The same foot with its ankle elsewhere.
    pub(super) fn moved_to(&self, position: DVec3, rotation: DQuat) -> Self {
        let turn = rotation * self.end.1.conjugate();
        let ball = self.ball.map(|(place, turned)| (position + turn * (place - self.end.0), turn * turned));
        Self { end: (position, rotation), ball }
    }

    /// What a point of the foot, from its ankle, measures along a direction.
    fn along(&self, direction: DVec3) -> impl Fn(&SupportPoint) -> f64 + use<> {
        let of_end = self.end.1.conjugate() * direction;
        let toes = self.ball.map(|(ball, turned)| ((ball - self.end.0).dot(direction), turned.conjugate() * direction));
        move |point| {
            let end = of_end.dot(point.from_end);
            let Some((ball, of_ball)) = toes.filter(|_| point.toes > 0.0) else { return end };
            end + (ball + of_ball.dot(point.from_ball) - end) * point.toes
        }
    }

    /// Height of the lowest of the points that are wanted.
    pub(in super::super) fn lowest(
        &self,
        shape: &FootShape,
        up: DVec3,
        is_wanted: impl Fn(&SupportPoint) -> bool,
    ) -> f64 {
        let height = self.along(up);
        let points = shape.points.iter().filter(|point| is_wanted(point));
        let lowest = points.map(|point| height(point) - point.radius).fold(f64::INFINITY, f64::min);
        self.end.0.dot(up) + lowest
    }

    /// How far the foot is off standing flat, where `flat` is up at rest in the ankle's axes.
    pub(super) fn tilted(&self, flat: DVec3, up: DVec3) -> Option<Tilted> {
        let normal = self.end.1 * flat;
        let axis = normal.cross(up);
        let angle = axis.length().atan2(normal.dot(up));
        Some(Tilted { axis: axis.try_normalize()?, angle })
    }

    /// The angle by which the foot has to be turned toward flat about its ankle until none of the wanted points is below a height; the
    /// whole way where that is not enough.
    ///
    /// A point that is `a` above the ankle and `b` before the axis is `a · cos θ + b · sin θ` above it when turned by θ.
    pub(super) fn turn_above(
        &self,
        shape: &FootShape,
        up: DVec3,
        tilted: &Tilted,
        height: f64,
        is_wanted: impl Fn(&SupportPoint) -> bool,
    ) -> f64 {
        let (above, before) = (self.along(up), self.along(up.cross(tilted.axis)));
        let least = height - self.end.0.dot(up);
        let needed = |point: &SupportPoint| {
            let (a, b, least) = (above(point), before(point), least + point.radius);
            if a >= least {
                return 0.0;
            }
            let reach = a.hypot(b);
            if b <= 0.0 || reach <= least.abs() {
                // Turning it that way does not lift it far enough.
                return if b <= 0.0 { 0.0 } else { tilted.angle };
            }
            (b.atan2(a) - (least / reach).acos()).clamp(0.0, tilted.angle)
        };
        shape.points.iter().filter(|point| is_wanted(point)).map(needed).fold(0.0, f64::max)
    }
}
