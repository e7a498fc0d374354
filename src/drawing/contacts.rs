//! When the feet of the body that drives a drawing stand on the ground.

use glam::DVec3;

use super::{BodyMotion, facing::lasting};

/// Lower than this share of a leg above the ground a foot may stand.
const LOW_SHARE: f64 = 0.09;
/// Slower than this share of a leg a second it stands.
const SLOW_SHARE: f64 = 0.55;
/// Of the heights of the lowest foot, the share that is below the ground.
const GROUND_SHARE: f64 = 0.05;
/// Shorter contacts are none, and shorter gaps between contacts are none either.
const MIN_SECONDS: f64 = 0.1;

/// For each foot and frame, whether it stands. `leg` is the length of a leg.
pub(super) fn contacts(motion: &BodyMotion, feet: &[usize], leg: f64) -> Vec<Vec<bool>> {
    let frames = motion.frames();
    let places: Vec<Vec<DVec3>> =
        feet.iter().map(|&foot| (0..frames).map(|frame| motion.world_place(frame, foot)).collect()).collect();
    let mut lowest: Vec<f64> =
        (0..frames).map(|frame| places.iter().map(|places| places[frame].y).fold(f64::MAX, f64::min)).collect();
    lowest.sort_by(f64::total_cmp);
    let Some(&ground) = lowest.get((frames as f64 * GROUND_SHARE) as usize) else { return Vec::new() };
    let least = (MIN_SECONDS / motion.frame_time).round().max(1.0) as usize;
    let stands = |places: &Vec<DVec3>| -> Vec<bool> {
        let speed = |frame: usize| {
            let (before, after) = (frame.saturating_sub(1), (frame + 1).min(frames - 1));
            let seconds = (after - before).max(1) as f64 * motion.frame_time;
            places[after].distance(places[before]) / seconds
        };
        let is_low_and_slow =
            |frame: usize| places[frame].y < ground + LOW_SHARE * leg && speed(frame) < SLOW_SHARE * leg;
        lasting(&(0..frames).map(is_low_and_slow).collect::<Vec<_>>(), least)
    };
    places.iter().map(stands).collect()
}

/// The runs of frames in which something is so: from the first to behind the last.
pub(super) fn runs(states: &[bool]) -> Vec<std::ops::Range<usize>> {
    let mut runs = Vec::new();
    let mut begin = 0;
    for run in states.chunk_by(|one, other| one == other) {
        if run[0] {
            runs.push(begin..begin + run.len());
        }
        begin += run.len();
    }
    runs
}
