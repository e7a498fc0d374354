//! How far a figure gets over the floor, and by how much it turns.

use glam::{DQuat, DVec3};

use super::{Transform, rotation::twist};

/// A turn about the vertical and a level way: what takes a figure from one place on the floor to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Travel {
    /// About the vertical.
    pub turn: DQuat,
    /// After the turn.
    pub way: DVec3,
}

impl Travel {
    /// The figure stays where it is.
    pub const NONE: Self = Self { turn: DQuat::IDENTITY, way: DVec3::ZERO };

    /// Takes a joint from where it stands and heads to where it does later; its height and tilt may differ. `up` is of unit length, in
    /// the space of the transforms.
    #[must_use]
    pub fn between(start: &Transform, end: &Transform, up: DVec3) -> Self {
        let turn = twist((end.rotation * start.rotation.conjugate()).normalize(), up);
        let way = end.translation - turn * start.translation;
        Self { turn, way: way - up * way.dot(up) }
    }

    /// Where a place gets to.
    #[must_use]
    pub fn place(&self, place: DVec3) -> DVec3 {
        self.turn * place + self.way
    }

    /// What gets there when `next` is gone from the place and in the direction that this one leads to.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        Self { turn: (self.turn * next.turn).normalize(), way: self.place(next.way) }
    }

    /// What leads back.
    #[must_use]
    pub fn inverse(self) -> Self {
        let turn = self.turn.conjugate();
        Self { turn, way: -(turn * self.way) }
    }

    /// Gone so many times; back where that is negative.
    #[must_use]
    pub fn times(self, times: i64) -> Self {
        let once = if times < 0 { self.inverse() } else { self };
        (0..times.unsigned_abs()).fold(Self::NONE, |gone, _| gone.then(once))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_gone_on_and_back() {
        let turn = DQuat::from_rotation_y(0.3);
        let start = Transform { translation: DVec3::new(1.0, 0.9, 2.0), ..Transform::IDENTITY };
        let end = Transform {
            translation: DVec3::new(3.0, 1.1, 2.5),
            rotation: turn * DQuat::from_rotation_x(0.2),
            ..Transform::IDENTITY
        };
        let travel = Travel::between(&start, &end, DVec3::Y);
        assert!(travel.turn.angle_between(turn) < 1e-6, "tilts are no turn: {travel:?}");
        let arrived = travel.place(start.translation);
        assert!((arrived - DVec3::new(3.0, 0.9, 2.5)).length() < 1e-12, "{arrived} keeps its height");
        let back = travel.times(3).then(travel.times(-3));
        assert!(back.way.length() < 1e-12 && back.turn.angle_between(DQuat::IDENTITY) < 1e-6, "{back:?}");
        let twice = travel.place(travel.place(start.translation));
        assert!((travel.times(2).place(start.translation) - twice).length() < 1e-12, "{twice}");
    }
}
