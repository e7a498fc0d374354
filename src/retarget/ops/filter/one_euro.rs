//! The One-Euro filter: a low pass whose cutoff rises with the angular speed, forward and backward, so that nothing is delayed.

use std::f64::consts::TAU;

use glam::{DQuat, DVec4};

/// The cutoff of the filter of the angular speed itself, Hz.
const SPEED_CUTOFF: f64 = 1.0;

/// Both passes, and what lies in the middle between them.
///
/// `min_frequency` is what is let through at rest, in Hz; each radian per second adds `responsiveness`.
pub(in crate::retarget) fn one_euro(
    rotations: &[DQuat],
    times: &[f64],
    min_frequency: f64,
    responsiveness: f64,
) -> Vec<DQuat> {
    let forward = pass(rotations, times, min_frequency, responsiveness);
    let reversed: Vec<DQuat> = rotations.iter().rev().copied().collect();
    let reversed_times: Vec<f64> = times.iter().rev().map(|time| -time).collect();
    let backward = pass(&reversed, &reversed_times, min_frequency, responsiveness);
    forward.iter().zip(backward.iter().rev()).map(|(forward, backward)| forward.slerp(*backward, 0.5)).collect()
}

fn pass(rotations: &[DQuat], times: &[f64], min_frequency: f64, responsiveness: f64) -> Vec<DQuat> {
    let Some(&first) = rotations.first() else { return Vec::new() };
    let (mut filtered, mut speed) = (first, 0.0);
    let share = |cutoff: f64, seconds: f64| 1.0 / (1.0 + 1.0 / (TAU * cutoff * seconds));
    let mut result = vec![first];
    for (pair, times) in rotations.windows(2).zip(times.windows(2)) {
        let seconds = times[1] - times[0];
        let turn = DVec4::from(pair[0].conjugate() * pair[1]);
        let angle = 2.0 * turn.truncate().length().atan2(turn.w.abs());
        speed += (angle / seconds - speed) * share(SPEED_CUTOFF, seconds);
        let cutoff = min_frequency + responsiveness * speed;
        filtered = filtered.slerp(pair[1], share(cutoff, seconds)).normalize();
        result.push(filtered);
    }
    result
}
