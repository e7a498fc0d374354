//! How feet and pelvis are moved up and down, smoothly over time.

use glam::DVec2;

use super::{Clearance, FloorStage};
use crate::retarget::stages::{
    temporal::{smoothed, smoothed_above},
    work::Work,
};

/// Standard deviation of the smoothing of what the pelvis follows.
const SHIFT_SECONDS: f64 = 0.16;
/// Standard deviation of the smoothing of what a foot is moved beyond the pelvis: a sole of a few points rolls in jolts, one of
/// flesh does not.
const LIFT_SECONDS: f64 = 0.04;
/// Rounds in which that smoothing is made up for where a sole is in the floor.
const LIFT_ROUNDS: usize = 2;

/// How far a foot is moved.
#[derive(Clone, Copy)]
pub(in crate::retarget) struct Lift {
    /// Beyond the shift of the pelvis.
    pub(in crate::retarget) beyond: f64,
    /// What it has to be moved by to stay out of the floor.
    pub(in crate::retarget) least: f64,
}

/// Smooth over time, and nowhere less than the least.
pub(in crate::retarget) fn smoothed_lifts(mut lifts: Vec<Lift>, times: &[f64]) -> Vec<Lift> {
    let beyond: Vec<f64> = lifts.iter().map(|lift| lift.beyond).collect();
    let least: Vec<f64> = lifts.iter().map(|lift| lift.least).collect();
    let beyond = smooth_above(&beyond, &least, times, LIFT_SECONDS);
    lifts.iter_mut().zip(beyond).for_each(|(lift, beyond)| lift.beyond = beyond);
    lifts
}

/// Values smoothed under a bell, and nowhere less than the least.
pub(in crate::retarget) fn smooth_above(
    values: &[f64],
    least: &[f64],
    times: &[f64],
    deviation_seconds: f64,
) -> Vec<f64> {
    let mut smooth = smoothed(values, times, deviation_seconds);
    let missing = |smooth: &[f64]| -> Vec<f64> {
        least.iter().zip(smooth).map(|(least, smooth)| (least - smooth).max(0.0)).collect()
    };
    let add = |smooth: &mut [f64], more: Vec<f64>| {
        smooth.iter_mut().zip(more).for_each(|(smooth, more)| *smooth += more);
    };
    // Smoothing takes the tips off, so what is still missing is added again, as smoothly.
    for _ in 0..LIFT_ROUNDS {
        let more = smoothed(&missing(&smooth), times, deviation_seconds);
        add(&mut smooth, more);
    }
    // The little that is left then goes, too.
    let more = smoothed_above(&missing(&smooth), times, deviation_seconds);
    add(&mut smooth, more);
    smooth
}

impl FloorStage {
    /// How far the pelvis goes up or down with the feet that carry it: the mean of what they need; `wants` says what a foot needs at a
    /// frame where it carries. Straight from one contact to the next, and smooth over time: frames in which two feet carry count
    /// twice in that, since two knees bend for what is left.
    pub(in crate::retarget) fn shifts(
        &self,
        rows: &[Clearance],
        work: &Work<'_>,
        wants: impl Fn(usize, usize, &Clearance) -> Option<f64>,
    ) -> Vec<f64> {
        let width = self.feet.len().max(1);
        let mut known: Vec<(usize, DVec2)> = Vec::new();
        for (frame, row) in rows.chunks_exact(width).enumerate() {
            let lifts = row.iter().enumerate().filter_map(|(foot, clearance)| wants(foot, frame, clearance));
            let sum: DVec2 = lifts.map(|lift| DVec2::new(lift, 1.0)).sum();
            if sum.y > 0.0 {
                known.push((frame, sum));
            }
        }
        straight(&known, work.times)
    }
}

/// From one known value to the next, then smooth. Values come as sums of several, with their number.
fn straight(known: &[(usize, DVec2)], times: &[f64]) -> Vec<f64> {
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![0.0; times.len()] };
    let mut sums = Vec::with_capacity(times.len());
    let mut next = 0;
    for frame in 0..times.len() {
        while next < known.len() && known[next].0 < frame {
            next += 1;
        }
        let after = known.get(next).unwrap_or(last);
        let before = next.checked_sub(1).map_or(first, |before| &known[before]);
        let span = times[after.0] - times[before.0];
        let share = if span > 0.0 { ((times[frame] - times[before.0]) / span).clamp(0.0, 1.0) } else { 1.0 };
        sums.push(before.1.lerp(after.1, share));
    }
    let smooth = smoothed(&sums, times, SHIFT_SECONDS);
    smooth.into_iter().map(|sum| sum.x / sum.y).collect()
}
