//! Helpers that look along the time of a clip.

use std::{
    collections::VecDeque,
    ops::{Add, Div, Mul, Range},
};

use glam::{DQuat, DVec3};
use rayon::prelude::*;

use super::work::CHUNK_FRAMES;

/// How far the bell (1 − u²)⁴ over u = distance / reach reaches, in its standard deviations: √11.
const REACH_DEVIATIONS: f64 = 3.316_624_790_355_4;

/// Smooths numbers or vectors that are sampled at rising times under a [`Bell`] of that standard deviation. Weighs by time, so the
/// frame rate does not matter; symmetric, so nothing is delayed.
pub(in crate::retarget) fn smoothed<T>(values: &[T], times: &[f64], deviation_seconds: f64) -> Vec<T>
where
    T: Copy + Default + Send + Sync + Add<Output = T> + Mul<f64, Output = T> + Div<f64, Output = T>,
{
    smoothed_in(Vec::new(), values, times, deviation_seconds)
}

/// The same, in a vector that was used before.
pub(in crate::retarget) fn smoothed_in<T>(room: Vec<T>, values: &[T], times: &[f64], deviation_seconds: f64) -> Vec<T>
where
    T: Copy + Default + Send + Sync + Add<Output = T> + Mul<f64, Output = T> + Div<f64, Output = T>,
{
    under_bell(room, values, times, deviation_seconds, |bell, frame, near| {
        let (mut sum, mut weights) = (T::default(), 0.0);
        let mut add = |value: T, weight: f64| {
            sum = sum + value * weight;
            weights += weight;
        };
        match bell.weights(frame, &near) {
            Some(weights) => values[near].iter().zip(weights).for_each(|(value, weight)| add(*value, *weight)),
            None => near.for_each(|other| add(values[other], bell.at(times[other] - times[frame]))),
        }
        sum / weights
    })
}

/// What is nowhere below the values and as smooth as under that bell: the largest value near each frame, smoothed.
pub(in crate::retarget) fn smoothed_above(values: &[f64], times: &[f64], deviation_seconds: f64) -> Vec<f64> {
    if deviation_seconds <= 0.0 {
        return values.to_vec();
    }
    let largest = largest_near(values, times, Bell::reach_seconds(deviation_seconds));
    smoothed(&largest, times, deviation_seconds)
}

/// The largest value within a time of each frame. Of the frames that are near, only those are kept in mind of which none behind has
/// a larger value: the first one of them has the largest.
fn largest_near(values: &[f64], times: &[f64], reach_seconds: f64) -> Vec<f64> {
    let (mut candidates, mut after) = (VecDeque::<usize>::new(), 0);
    let largest = (0..values.len()).map(|frame| {
        while after < values.len() && times[after] <= times[frame] + reach_seconds {
            while candidates.back().is_some_and(|last| values[*last] <= values[after]) {
                candidates.pop_back();
            }
            candidates.push_back(after);
            after += 1;
        }
        while candidates.front().is_some_and(|first| times[*first] < times[frame] - reach_seconds) {
            candidates.pop_front();
        }
        candidates.front().map_or(values[frame], |first| values[*first])
    });
    largest.collect()
}

/// The same of rotations.
pub(in crate::retarget) fn smoothed_rotations(values: &[DQuat], times: &[f64], deviation_seconds: f64) -> Vec<DQuat> {
    under_bell(Vec::new(), values, times, deviation_seconds, |bell, frame, near| {
        let own = values[frame];
        let mut sum = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        let mut add = |value: DQuat, weight: f64| sum += value * if own.dot(value) < 0.0 { -weight } else { weight };
        match bell.weights(frame, &near) {
            Some(weights) => values[near].iter().zip(weights).for_each(|(value, weight)| add(*value, *weight)),
            None => near.for_each(|other| add(values[other], bell.at(times[other] - times[frame]))),
        }
        if sum.length_squared() > 0.0 { sum.normalize() } else { own }
    })
}

/// Weights that fall from one to nothing with the distance in time: close to a normal distribution of the same deviation, but it
/// ends by itself, so rounding of the times decides nothing, and it costs a few products.
struct Bell {
    reach_seconds: f64,
    /// Weights by how many frames are between, where those are evenly spaced: as far as the bell reaches, and a little beyond. From
    /// those of frames before to those of frames behind.
    by_frames: Vec<f64>,
}

impl Bell {
    fn new(times: &[f64], deviation_seconds: f64) -> Self {
        let mut bell = Self { reach_seconds: Self::reach_seconds(deviation_seconds), by_frames: Vec::new() };
        if let Some(step_seconds) = even_step(times) {
            let reached = (bell.reach_seconds / step_seconds).min(times.len() as f64) as usize + 2;
            let weight = |frames: usize| bell.at(frames as f64 * step_seconds);
            bell.by_frames = (1..=reached).rev().chain(0..=reached).map(weight).collect();
        }
        bell
    }

    fn reach_seconds(deviation_seconds: f64) -> f64 {
        REACH_DEVIATIONS * deviation_seconds
    }

    fn at(&self, seconds: f64) -> f64 {
        let share = seconds / self.reach_seconds;
        let square = (1.0 - share * share).max(0.0).powi(2);
        square * square
    }

    /// How much frames near a frame count there, where frames are evenly spaced.
    fn weights(&self, frame: usize, near: &Range<usize>) -> Option<&[f64]> {
        let own = self.by_frames.len() / 2;
        self.by_frames.get((own + near.start).checked_sub(frame)?..(own + near.end).checked_sub(frame)?)
    }
}

/// The time between frames, where it is the same between all of them but for the rounding of times to single precision.
fn even_step(times: &[f64]) -> Option<f64> {
    let (first, last) = (*times.first()?, *times.last()?);
    let step = (last - first) / (times.len() - 1).max(1) as f64;
    let slack = (step * 1e-3).min(last.abs().max(first.abs()) * f64::from(f32::EPSILON) + step * 1e-9);
    let is_even = |(frame, time): (usize, &f64)| (first + frame as f64 * step - time).abs() <= slack;
    (step > 0.0 && times.iter().enumerate().all(is_even)).then_some(step)
}

/// Calls `mean` for every frame with the frames that the bell reaches from there; copies the values where nothing is smoothed. In
/// parallel: a frame's mean depends on the values only, so the result does not depend on the number of threads. `room` becomes the result.
fn under_bell<T: Copy + Send + Sync>(
    room: Vec<T>,
    values: &[T],
    times: &[f64],
    deviation_seconds: f64,
    mean: impl Fn(&Bell, usize, Range<usize>) -> T + Sync,
) -> Vec<T> {
    let mut result = room;
    result.clear();
    result.extend_from_slice(values);
    if deviation_seconds <= 0.0 {
        return result;
    }
    let bell = Bell::new(times, deviation_seconds);
    result.par_chunks_mut(CHUNK_FRAMES).enumerate().for_each(|(chunk, result)| {
        let begin = chunk * CHUNK_FRAMES;
        let mut first = times.partition_point(|time| *time < times[begin] - bell.reach_seconds);
        let mut after = begin;
        for (frame, result) in (begin..).zip(result) {
            while times[first] < times[frame] - bell.reach_seconds {
                first += 1;
            }
            while after < values.len() && times[after] <= times[frame] + bell.reach_seconds {
                after += 1;
            }
            *result = mean(&bell, frame, first..after);
        }
    });
    result
}

/// Speeds by central differences, in units per second; 0 for a single frame.
pub(in crate::retarget) fn speeds(values: &[DVec3], times: &[f64]) -> Vec<f64> {
    speeds_between(values, times, |frame, last| (frame.saturating_sub(1), (frame + 1).min(last)))
}

/// Speeds from every frame to the next, in units per second; the last frame has that of the one before; 0 for a single frame.
pub(in crate::retarget) fn forward_speeds(values: &[DVec3], times: &[f64]) -> Vec<f64> {
    speeds_between(values, times, |frame, last| {
        let before = frame.min(last.saturating_sub(1));
        (before, (before + 1).min(last))
    })
}

/// Speeds between two frames that are told for each frame and the last one; 0 where no time is between them.
fn speeds_between(values: &[DVec3], times: &[f64], span: impl Fn(usize, usize) -> (usize, usize)) -> Vec<f64> {
    let speed = |frame: usize| {
        let (before, after) = span(frame, values.len() - 1);
        let seconds = times[after] - times[before];
        if seconds > 0.0 { values[after].distance(values[before]) / seconds } else { 0.0 }
    };
    (0..values.len()).map(speed).collect()
}

/// First and last frame of every run of `true`.
pub(in crate::retarget) fn runs(flags: &[bool]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut begin = None;
    for (frame, &flag) in flags.iter().enumerate() {
        match (begin, flag) {
            (None, true) => begin = Some(frame),
            (Some(first), false) => {
                runs.push((first, frame - 1));
                begin = None;
            }
            _ => {}
        }
    }
    runs.extend(begin.map(|first| (first, flags.len() - 1)));
    runs
}

/// The middle value; nothing of nothing.
pub(in crate::retarget) fn median(values: &mut [f64]) -> Option<f64> {
    values.sort_unstable_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smoothing_keeps_what_is_even_and_what_is_symmetric() {
        let times: Vec<f64> = (0..21).map(|frame| f64::from(frame) * 0.1).collect();
        let line: Vec<DVec3> = times.iter().map(|time| DVec3::new(*time, 2.0, 0.0)).collect();
        let result = smoothed(&line, &times, 0.1);
        assert!((result[10] - line[10]).length() < 1e-12, "a straight line stays: {}", result[10]);
        let mut spike = vec![DVec3::ZERO; 21];
        spike[10] = DVec3::X;
        let result = smoothed(&spike, &times, 0.1);
        assert!((result[8].x - result[12].x).abs() < 1e-12, "nothing is delayed");
    }

    #[test]
    fn what_is_smoothed_above_is_nowhere_below() {
        let times: Vec<f64> = (0..41).map(|frame| f64::from(frame) * 0.02).collect();
        let values: Vec<f64> = (0..41).map(|frame| if frame % 17 == 5 { f64::from(frame) } else { 0.0 }).collect();
        let above = smoothed_above(&values, &times, 0.04);
        assert!(above.iter().zip(&values).all(|(above, value)| *above > value - 1e-9), "{above:?}");
        let jolt = |values: &[f64]| -> f64 {
            values.windows(3).map(|three| (three[0] - 2.0 * three[1] + three[2]).abs()).sum()
        };
        assert!(jolt(&above) < jolt(&values) / 5.0, "{} of {}", jolt(&above), jolt(&values));
        assert_eq!(smoothed_above(&values, &times, 0.0), values, "nothing is smoothed");
    }

    #[test]
    fn weights_by_frames_are_those_by_time() {
        let values: Vec<f64> = (0..200).map(|frame| f64::from(frame * 37 % 101)).collect();
        let even: Vec<f64> = (0..200).map(|frame| f64::from((frame as f32) / 30.0)).collect();
        assert!(even_step(&even).is_some(), "but for rounding");
        let mut uneven = even.clone();
        uneven[0] -= 0.01;
        assert!(even_step(&uneven).is_none() && even_step(&[2.0]).is_none(), "no step");
        for deviation in [0.001, 0.03, 0.2, 100.0] {
            let bell = Bell { reach_seconds: Bell::reach_seconds(deviation), by_frames: Vec::new() };
            let found = smoothed(&values, &even, deviation);
            for (frame, found) in found.iter().enumerate() {
                let weights: Vec<f64> = even.iter().map(|time| bell.at(time - even[frame])).collect();
                let sum: f64 = values.iter().zip(&weights).map(|(value, weight)| value * weight).sum();
                let expected = sum / weights.iter().sum::<f64>();
                assert!((found - expected).abs() < 2e-3, "{deviation}, frame {frame}: {found} and {expected}");
            }
        }
    }

    #[test]
    fn the_largest_near_is_that_of_all_that_are_near() {
        let times: Vec<f64> = (0..300).map(|frame| f64::from(frame) * 0.02 + f64::from(frame % 3) * 0.004).collect();
        let values: Vec<f64> = (0..300).map(|frame: i32| f64::from(frame * 7919 % 31) - 15.0).collect();
        for reach in [0.0, 0.019, 0.1, 9.0] {
            let largest = largest_near(&values, &times, reach);
            for (frame, largest) in largest.iter().enumerate() {
                let near = (0..300)
                    .filter(|other| times[*other] <= times[frame] + reach && times[*other] >= times[frame] - reach);
                let expected = near.map(|other| values[other]).fold(f64::NEG_INFINITY, f64::max);
                assert_eq!((*largest).to_bits(), expected.to_bits(), "{reach}, frame {frame}");
            }
        }
    }

    #[test]
    fn runs_reach_to_both_ends() {
        assert_eq!(runs(&[true, true, false, true]), [(0, 1), (3, 3)], "both ends included");
        assert_eq!(runs(&[false, false]), [], "none");
    }

    #[test]
    fn speed_is_per_second_whatever_the_frame_rate() {
        let times = [0.0, 0.5, 0.6];
        let values = times.map(|time| DVec3::X * time * 3.0);
        for speed in speeds(&values, &times) {
            assert!((speed - 3.0).abs() < 1e-12, "{speed}");
        }
        assert_eq!(speeds(&[DVec3::X], &[0.0]), [0.0], "one frame does not move");
    }

    #[test]
    fn a_point_that_stops_rests_from_that_frame_on() {
        let times = [0.0, 0.1, 0.2, 0.3, 0.4];
        let values = [0.0, 1.0, 2.0, 2.0, 2.0].map(|x| DVec3::X * x);
        let speeds = forward_speeds(&values, &times);
        let expected = [10.0, 10.0, 0.0, 0.0, 0.0];
        assert!(speeds.iter().zip(expected).all(|(speed, expected)| (speed - expected).abs() < 1e-9), "{speeds:?}");
        assert_eq!(forward_speeds(&[DVec3::X], &[0.0]), [0.0], "one frame does not move");
        assert!(forward_speeds(&[], &[]).is_empty());
    }
}
