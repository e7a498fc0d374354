//! Helpers that look along the time of a clip.

use std::ops::{Add, Div, Mul, Range};

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
    under_bell(values, times, deviation_seconds, |bell, frame, near| {
        let (mut sum, mut weights) = (T::default(), 0.0);
        for other in near {
            let weight = bell.weight(times[other] - times[frame]);
            sum = sum + values[other] * weight;
            weights += weight;
        }
        sum / weights
    })
}

/// What is nowhere below the values and as smooth as under that bell: the largest value near each frame, smoothed.
pub(in crate::retarget) fn smoothed_above(values: &[f64], times: &[f64], deviation_seconds: f64) -> Vec<f64> {
    let largest = under_bell(values, times, deviation_seconds, |_, frame, near| {
        values[near].iter().copied().fold(values[frame], f64::max)
    });
    smoothed(&largest, times, deviation_seconds)
}

/// The same of rotations.
pub(in crate::retarget) fn smoothed_rotations(values: &[DQuat], times: &[f64], deviation_seconds: f64) -> Vec<DQuat> {
    under_bell(values, times, deviation_seconds, |bell, frame, near| {
        let own = values[frame];
        let mut sum = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        for other in near {
            let weight = bell.weight(times[other] - times[frame]);
            sum += values[other] * if own.dot(values[other]) < 0.0 { -weight } else { weight };
        }
        if sum.length_squared() > 0.0 { sum.normalize() } else { own }
    })
}

/// Weights that fall from one to nothing with the distance in time: close to a normal distribution of the same deviation, but it
/// ends by itself, so rounding of the times decides nothing, and it costs a few products.
struct Bell {
    reach_seconds: f64,
}

impl Bell {
    fn weight(&self, seconds: f64) -> f64 {
        let share = seconds / self.reach_seconds;
        let square = (1.0 - share * share).max(0.0).powi(2);
        square * square
    }
}

/// Calls `mean` for every frame with the frames that the bell reaches from there; copies the values where nothing is smoothed. In
/// parallel: a frame's mean depends on the values only, so the result does not depend on the number of threads.
fn under_bell<T: Copy + Send + Sync>(
    values: &[T],
    times: &[f64],
    deviation_seconds: f64,
    mean: impl Fn(&Bell, usize, Range<usize>) -> T + Sync,
) -> Vec<T> {
    let mut result = values.to_vec();
    if deviation_seconds <= 0.0 {
        return result;
    }
    let bell = Bell { reach_seconds: REACH_DEVIATIONS * deviation_seconds };
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
    let last = values.len() - 1;
    let speed = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(last));
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
}
