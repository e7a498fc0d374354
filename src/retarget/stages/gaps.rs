//! How far balls and capsules are from capsules.

use glam::DVec3;

use super::posing::{Pose, Posing};
use crate::rig::Capsule;

/// A capsule in a pose.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Line {
    pub(in crate::retarget) start: DVec3,
    pub(in crate::retarget) end: DVec3,
    pub(in crate::retarget) radius: f64,
}

impl Line {
    /// The place at a share of the length.
    pub(in crate::retarget) fn at(&self, share: f64) -> DVec3 {
        self.start + (self.end - self.start) * share
    }
}

/// A capsule with the slots of its joints in a posing.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Fixed {
    pub(in crate::retarget) start: (usize, DVec3),
    pub(in crate::retarget) end: (usize, DVec3),
    pub(in crate::retarget) radius: f64,
}

impl Fixed {
    pub(in crate::retarget) fn new(capsule: &Capsule, posing: &Posing) -> Self {
        let fixed = |anchor: crate::rig::Anchor| (posing.slot(anchor.joint), anchor.offset);
        Self { start: fixed(capsule.start), end: fixed(capsule.end), radius: capsule.radius }
    }

    pub(in crate::retarget) fn line(&self, pose: &Pose) -> Line {
        let place = |(slot, offset): (usize, DVec3)| {
            let joint = &pose.model[slot];
            joint.translation + joint.rotation * offset
        };
        Line { start: place(self.start), end: place(self.end), radius: self.radius }
    }
}

/// Where a ball is about a capsule.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Gap {
    /// Share of the capsule's length at which it is nearest.
    pub(in crate::retarget) share: f64,
    /// From there to the ball; unit length, or nothing where the ball is on the line.
    pub(in crate::retarget) away: DVec3,
    /// Between the surfaces; below 0 where one is in the other.
    pub(in crate::retarget) distance: f64,
}

/// Between a capsule and a ball.
pub(in crate::retarget) fn between(line: &Line, center: DVec3, radius: f64) -> Gap {
    let along = line.end - line.start;
    let squared = along.length_squared();
    let share = if squared > 0.0 { ((center - line.start).dot(along) / squared).clamp(0.0, 1.0) } else { 0.0 };
    let away = center - line.at(share);
    Gap { share, away: away.normalize_or_zero(), distance: away.length() - line.radius - radius }
}

/// Where capsules are nearest to each other.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Nearest {
    /// On the line of the second.
    pub(in crate::retarget) place: DVec3,
    /// From the line of the first to that place; unit length, or nothing where the lines meet.
    pub(in crate::retarget) away: DVec3,
    /// Between the surfaces; below 0 where one is in the other.
    pub(in crate::retarget) distance: f64,
}

/// Between two capsules. (Ericson, Real-Time Collision Detection, 5.1.9.)
pub(in crate::retarget) fn nearest(first: &Line, second: &Line) -> Nearest {
    let (along_first, along_second) = (first.end - first.start, second.end - second.start);
    let from_second = first.start - second.start;
    let (squared_first, squared_second) = (along_first.length_squared(), along_second.length_squared());
    let together = along_first.dot(along_second);
    let (of_first, of_second) = (along_first.dot(from_second), along_second.dot(from_second));
    let share = |above: f64, below: f64| if below > 0.0 { (above / below).clamp(0.0, 1.0) } else { 0.0 };
    let across = squared_first * squared_second - together * together;
    let is_askew = across > 1e-12 * squared_first * squared_second;
    let on_first = if is_askew { share(together * of_second - of_first * squared_second, across) } else { 0.0 };
    let on_second = share(together * on_first + of_second, squared_second);
    let on_first = share(together * on_second - of_first, squared_first);
    let place = second.at(on_second);
    let away = place - first.at(on_first);
    Nearest { place, away: away.normalize_or_zero(), distance: away.length() - first.radius - second.radius }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaps_are_measured_from_surface_to_surface() {
        let line = Line { start: DVec3::ZERO, end: DVec3::Y, radius: 0.2 };
        let beside = between(&line, DVec3::new(0.5, 0.25, 0.0), 0.1);
        assert!((beside.distance - 0.2).abs() < 1e-12 && (beside.share - 0.25).abs() < 1e-12, "{beside:?}");
        assert!((beside.away - DVec3::X).length() < 1e-12, "to the side");
        let above = between(&line, DVec3::Y * 1.25, 0.1);
        assert!((above.distance + 0.05).abs() < 1e-12 && above.share == 1.0, "in its cap: {above:?}");
        let on_it = between(&line, DVec3::Y * 0.5, 0.1);
        assert!(on_it.away == DVec3::ZERO && (on_it.distance + 0.3).abs() < 1e-12, "no side: {on_it:?}");
        let ball = between(&Line { end: DVec3::ZERO, ..line }, DVec3::Z, 0.1);
        assert!((ball.distance - 0.7).abs() < 1e-12, "a capsule of no length: {ball:?}");
    }

    #[test]
    fn capsules_are_nearest_where_their_lines_are() {
        let line = |start: DVec3, end: DVec3| Line { start, end, radius: 0.1 };
        let standing = line(DVec3::ZERO, DVec3::Y);
        let crossing = nearest(&standing, &line(DVec3::new(-1.0, 0.5, 0.3), DVec3::new(1.0, 0.5, 0.3)));
        assert!((crossing.distance - 0.1).abs() < 1e-12 && (crossing.away - DVec3::Z).length() < 1e-12, "{crossing:?}");
        assert!((crossing.place - DVec3::new(0.0, 0.5, 0.3)).length() < 1e-12, "{crossing:?}");
        let beside = nearest(&standing, &line(DVec3::X, DVec3::X + DVec3::Y));
        assert!((beside.distance - 0.8).abs() < 1e-12 && (beside.away - DVec3::X).length() < 1e-12, "{beside:?}");
        let above = nearest(&standing, &line(DVec3::Y * 1.5, DVec3::Y * 3.0));
        assert!((above.distance - 0.3).abs() < 1e-12 && (above.place - DVec3::Y * 1.5).length() < 1e-12, "{above:?}");
        let ball = nearest(&standing, &line(DVec3::new(0.4, 0.25, 0.0), DVec3::new(0.4, 0.25, 0.0)));
        assert!((ball.distance - 0.2).abs() < 1e-12 && (ball.away - DVec3::X).length() < 1e-12, "{ball:?}");
        let meets = nearest(&standing, &line(DVec3::new(-1.0, 0.5, 0.0), DVec3::new(1.0, 0.5, 0.0)));
        assert!(meets.away == DVec3::ZERO && (meets.distance + 0.2).abs() < 1e-12, "no side: {meets:?}");
    }
}
