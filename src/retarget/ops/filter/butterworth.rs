//! Butterworth's low pass, forward and backward, as biomechanics uses it: nothing is delayed.
//!
//! Each pass is of the second order, both together of the fourth; the cutoff of each is raised by (√2 − 1)^−¼, so that of a swing at the
//! cutoff that was asked for 1/√2 is left after both (Winter, "Biomechanics and Motor Control of Human Movement", on low-pass filters).
//! The components of quaternions are filtered and made unit again: what turns on and on comes out turning on and on. Before the first
//! and after the last frame the motion is taken to go on, turned about that frame. Uneven keys are filtered on an even grid,
//! straight lines to and from which take a little more.

use std::f64::consts::{PI, SQRT_2};

use glam::{DQuat, DVec4};

use super::on_one_hemisphere;

/// Steps that differ by less than this share are even.
const EVEN_SHARE: f64 = 1e-3;
/// A grid has this many steps in a period of the cutoff at least, and at most so many frames for each frame of the clip.
const STEPS_PER_PERIOD: f64 = 10.0;
const MAX_GRID_FACTOR: f64 = 16.0;
/// Periods of the cutoff after which nothing of the beginning is left.
const SETTLED_PERIODS: f64 = 3.0;

/// Rotations are unit, and each on the hemisphere of the one before. At half the frame rate and above nothing is taken off.
pub(in crate::retarget) fn butterworth(rotations: &[DQuat], times: &[f64], cutoff_hertz: f64) -> Vec<DQuat> {
    let count = times.len();
    if count < 3 {
        return rotations.to_vec();
    }
    let duration = times[count - 1] - times[0];
    let step = duration / (count - 1) as f64;
    if times.windows(2).all(|pair| (pair[1] - pair[0] - step).abs() < EVEN_SHARE * step) {
        return both_ways(rotations, step, cutoff_hertz);
    }
    let mut gaps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    let fine = gaps[gaps.len() / 2].min(1.0 / (STEPS_PER_PERIOD * cutoff_hertz));
    let intervals = (duration / fine).ceil().min(count as f64 * MAX_GRID_FACTOR).max(2.0);
    let grid: Vec<f64> = (0..=intervals as usize).map(|index| times[0] + duration * index as f64 / intervals).collect();
    let even = both_ways(&on_one_hemisphere(at_times(rotations, times, &grid)), duration / intervals, cutoff_hertz);
    at_times(&even, &grid, times)
}

/// The rotations at other times, between keys the short way.
fn at_times(rotations: &[DQuat], times: &[f64], wanted: &[f64]) -> Vec<DQuat> {
    let at = |time: &f64| {
        let after = times.partition_point(|key| key <= time).clamp(1, times.len() - 1);
        let share = (time - times[after - 1]) / (times[after] - times[after - 1]);
        rotations[after - 1].slerp(rotations[after], share.clamp(0.0, 1.0))
    };
    wanted.iter().map(at).collect()
}

fn both_ways(rotations: &[DQuat], step_seconds: f64, cutoff_hertz: f64) -> Vec<DQuat> {
    let Some(section) = Section::new(cutoff_hertz * step_seconds) else { return rotations.to_vec() };
    let last = rotations.len() - 1;
    let pad = last.min((SETTLED_PERIODS / (cutoff_hertz * step_seconds)).ceil() as usize);
    let beyond = |end: DQuat, other: DQuat| end * other.conjugate() * end;
    let before = (1..=pad).rev().map(|offset| beyond(rotations[0], rotations[offset]));
    let after = (1..=pad).map(|offset| beyond(rotations[last], rotations[last - offset]));
    let padded = on_one_hemisphere(before.chain(rotations.iter().copied()).chain(after).collect());
    let mut values: Vec<DVec4> = padded.iter().map(|rotation| DVec4::from(*rotation)).collect();
    section.run(&mut values);
    values.reverse();
    section.run(&mut values);
    values.reverse();
    let unit = |(value, own): (&DVec4, &DQuat)| value.try_normalize().map_or(*own, DQuat::from_vec4);
    values[pad..].iter().zip(rotations).map(unit).collect()
}

/// A low pass of the second order.
struct Section {
    input: [f64; 3],
    output: [f64; 2],
}

impl Section {
    /// With a cutoff in periods per frame; nothing where it is half of one or more.
    fn new(cutoff: f64) -> Option<Self> {
        if cutoff.is_nan() || cutoff >= 0.5 {
            return None;
        }
        let k = (PI * cutoff).tan() / (SQRT_2 - 1.0).powf(0.25);
        let scale = 1.0 + SQRT_2 * k + k * k;
        let gain = k * k / scale;
        Some(Self {
            input: [gain, 2.0 * gain, gain],
            output: [2.0 * (k * k - 1.0) / scale, (1.0 - SQRT_2 * k + k * k) / scale],
        })
    }

    /// Begins as if the first value had been there forever.
    fn run(&self, values: &mut [DVec4]) {
        let Some(&first) = values.first() else { return };
        let (mut inputs, mut outputs) = ([first; 2], [first; 2]);
        for value in values {
            let input = *value;
            *value = input * self.input[0] + inputs[0] * self.input[1] + inputs[1] * self.input[2]
                - outputs[0] * self.output[0]
                - outputs[1] * self.output[1];
            inputs = [input, inputs[0]];
            outputs = [*value, outputs[0]];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUTOFF: f64 = 6.0;

    /// How much is left of a swing of that frequency, far from the ends.
    fn left_of(hertz: f64, times: &[f64]) -> f64 {
        let angle = |time: &f64| 0.05 * (std::f64::consts::TAU * hertz * time).sin();
        let swing: Vec<DQuat> = times.iter().map(|time| DQuat::from_rotation_z(angle(time))).collect();
        let filtered = butterworth(&swing, times, CUTOFF);
        let middle = times.len() / 4..times.len() * 3 / 4;
        let products =
            |one: &dyn Fn(usize) -> f64| middle.clone().map(|frame| one(frame) * angle(&times[frame])).sum::<f64>();
        let turned = |frame: usize| 2.0 * filtered[frame].z.atan2(filtered[frame].w);
        products(&turned) / products(&|frame| angle(&times[frame]))
    }

    #[test]
    fn a_swing_at_the_cutoff_keeps_a_half_of_its_power() {
        let even: Vec<f64> = (0..1200).map(|frame| f64::from(frame) / 120.0).collect();
        let uneven: Vec<f64> = (0..1200).map(|frame| f64::from(frame) / 120.0 + f64::from(frame % 5) * 0.001).collect();
        for (times, slack) in [(&even, 1e-3), (&uneven, 0.02)] {
            // 1 / (1 + (tan ratio)⁴ (√2 − 1)): what both passes leave.
            for hertz in [1.0, 3.0, 6.0, 12.0, 30.0] {
                let ratio = (PI * hertz / 120.0).tan() / (PI * CUTOFF / 120.0).tan();
                let wanted = 1.0 / (1.0 + ratio.powi(4) * (SQRT_2 - 1.0));
                let left = left_of(hertz, times);
                assert!((left - wanted).abs() < slack, "{hertz} Hz: {left} of {wanted}");
            }
        }
    }

    #[test]
    fn a_steady_turn_stays_up_to_its_ends_and_a_high_cutoff_takes_nothing() {
        let times: Vec<f64> = (0..90).map(|frame| f64::from(frame) / 30.0).collect();
        let turn: Vec<DQuat> = times.iter().map(|time| DQuat::from_rotation_y(time * 1.5)).collect();
        let worst = |cutoff: f64| {
            let filtered = butterworth(&turn, &times, cutoff);
            filtered.iter().zip(&turn).map(|(ours, own)| (*ours - *own).length()).fold(0.0, f64::max)
        };
        assert!(worst(4.0) < 1e-3, "{}", worst(4.0));
        assert_eq!(worst(15.0), 0.0, "half the frame rate");
    }
}
