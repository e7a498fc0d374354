//! How far a ball is from a capsule.

use glam::DVec3;

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
}
