//! What it costs a knee that its foot is moved.
//!
//! A leg that is nearly straight bends far for a little: at a leg of 1 m and a knee that is bent by 20 degrees, 1 cm is 7 degrees.

use glam::DVec3;

use super::Clearance;

/// Knees stretch by no more than this to put feet onto the floor in clips in which nothing says that they touch.
const MAX_STRETCH_RADIANS: f64 = 0.08;
/// A knee that is bent by an angle with a smaller sine counts as bent so: straight legs bend far for any move.
const STRAIGHT_KNEE_SINE: f64 = 0.35;

impl Clearance {
    /// How far a foot is to be moved: where nothing says that it touches, no farther down than its knee may stretch for it.
    pub(super) fn limited(&self, missing: f64, is_touching: bool) -> f64 {
        if is_touching { missing } else { missing.max(-MAX_STRETCH_RADIANS / self.bend.max(f64::MIN_POSITIVE)) }
    }
}

/// Radians by which a knee bends for each unit that the end of its leg is moved toward the hip from a place.
pub(super) fn bend_per_move([hip, knee, ankle]: [DVec3; 3], end: DVec3) -> f64 {
    let (thigh, shin, reach) = (hip.distance(knee), knee.distance(ankle), hip.distance(end));
    let product = thigh * shin;
    if product <= 0.0 {
        return 0.0;
    }
    let cosine = ((reach * reach - thigh * thigh - shin * shin) / (2.0 * product)).clamp(-1.0, 1.0);
    let sine = (1.0 - cosine * cosine).sqrt().max(STRAIGHT_KNEE_SINE);
    reach / (product * sine)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A leg of 1 m whose knee is bent by so many degrees.
    fn leg(degrees: f64) -> [DVec3; 3] {
        let shin = glam::DQuat::from_rotation_x(degrees.to_radians()) * DVec3::NEG_Y * 0.5;
        [DVec3::ZERO, DVec3::NEG_Y * 0.5, DVec3::NEG_Y * 0.5 + shin]
    }

    #[test]
    fn a_knee_bends_by_what_is_said() {
        for degrees in [25.0_f64, 60.0, 110.0] {
            let [_, knee, ankle] = leg(degrees);
            let moved = ankle.length() - 1e-5;
            // By the law of cosines, for a leg of two halves.
            let bent = ((moved * moved - 0.5) / 0.5).acos();
            let said = bend_per_move([DVec3::ZERO, knee, ankle], ankle);
            assert!(((bent - degrees.to_radians()) / 1e-5 - said).abs() < 1e-2 * said, "{degrees}: {said}");
        }
        assert!(bend_per_move(leg(0.0), DVec3::NEG_Y).is_finite(), "a straight leg");
        assert_eq!(bend_per_move([DVec3::ZERO; 3], DVec3::NEG_Y), 0.0, "a leg without length");
    }
}
