//! Feet of a figure that walks on the spot go along with the floor that runs below it.
//!
//! Such a floor has no places that feet must keep. What counts is that all feet go along with it at one speed, and that is the one that
//! changes the legs least: the source's, for its legs, times a share that is found from all contacts. Beside that a foot moves as the
//! source's does.

use std::ops::Range;

use glam::DVec3;

use crate::model::rotation::approach;

use super::{Foot, PlantStage};

/// By how much feet are moved for its sake, at most, for a leg of 1 m: legs that keep their shape count for more than feet that slide.
pub(super) const CARRIED_METERS: f64 = 0.04;

/// The floor below one foot.
#[derive(Clone, Copy, Debug)]
pub(super) struct RunningFloor {
    /// How fast it runs beside the source's, for legs of one length.
    pub(super) share: f64,
    /// By how much the foot is moved for its sake at most, in plan units.
    pub(super) most: f64,
}

impl RunningFloor {
    /// The same where it is small, and never longer than what the foot is moved at most; smooth in between.
    pub(super) fn limited(&self, offset: DVec3) -> DVec3 {
        let (length, most) = (offset.length(), self.most);
        if length > 0.0 && most > 0.0 { offset * (approach(length, 0.0, most) / length) } else { offset }
    }
}

impl PlantStage {
    /// How fast the floor runs below the target beside how fast it runs below the source, for legs of one length, by those frames.
    pub(super) fn floor_share(&self, feet: &[Option<Foot>], frames: Range<usize>) -> f64 {
        let (mut along, mut square) = (0.0, 0.0);
        for foot in feet.iter().flatten() {
            for (part, track) in foot.tracks.iter().enumerate() {
                let Some(track) = track else { continue };
                let stays = |frame: &usize| track.touches[*frame] && track.touches[frame + 1];
                for frame in (frames.start..frames.end.saturating_sub(1)).filter(stays) {
                    let wanted = foot.source_step(part, frame).unwrap_or_default().reject_from_normalized(self.up);
                    along += wanted.dot(foot.target_step(part, frame));
                    square += wanted.length_squared();
                }
            }
        }
        if square > 0.0 { along / square } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_offsets_are_kept_and_large_ones_are_limited() {
        let limited = |offset: DVec3, most: f64| RunningFloor { share: 1.0, most }.limited(offset);
        assert!((limited(DVec3::X * 1e-4, 0.02) - DVec3::X * 1e-4).length() < 1e-8, "small");
        assert!((limited(DVec3::Z * 5.0, 0.02) - DVec3::Z * 0.02).length() < 1e-12, "large");
        assert_eq!((limited(DVec3::ZERO, 0.02), limited(DVec3::X, 0.0)), (DVec3::ZERO, DVec3::X), "nothing");
    }
}
