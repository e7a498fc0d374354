//! Helpers that look along the time of a clip.

use glam::{DQuat, DVec3};

/// Smooths values that are sampled at rising times with a bell of that standard deviation, cut at three of them. Weighs by time,
/// so the frame rate does not matter; symmetric, so nothing is delayed.
pub(super) fn smoothed(values: &[DVec3], times: &[f64], deviation_seconds: f64) -> Vec<DVec3> {
    under_bell(values.len(), times, deviation_seconds, |frame, near| {
        if near.is_empty() {
            return values[frame];
        }
        let (sum, weights) = near.iter().fold((DVec3::ZERO, 0.0), |(sum, weights), (other, weight)| {
            (sum + values[*other] * *weight, weights + weight)
        });
        sum / weights
    })
}

/// What is nowhere below the values and as smooth as under that bell: the largest value near each frame, smoothed.
pub(super) fn smoothed_above(values: &[f64], times: &[f64], deviation_seconds: f64) -> Vec<f64> {
    let largest = under_bell(values.len(), times, deviation_seconds, |frame, near| {
        near.iter().fold(values[frame], |largest, (other, _)| largest.max(values[*other]))
    });
    under_bell(values.len(), times, deviation_seconds, |frame, near| {
        let (sum, weights) = near
            .iter()
            .fold((0.0, 0.0), |(sum, weights), (other, weight)| (sum + largest[*other] * weight, weights + weight));
        if weights > 0.0 { sum / weights } else { largest[frame] }
    })
}

/// The same of rotations.
pub(super) fn smoothed_rotations(values: &[DQuat], times: &[f64], deviation_seconds: f64) -> Vec<DQuat> {
    under_bell(values.len(), times, deviation_seconds, |frame, near| {
        let own = values[frame];
        let sum = near.iter().fold(DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0), |sum, (other, weight)| {
            let other = values[*other];
            sum + other * if own.dot(other) < 0.0 { -weight } else { *weight }
        });
        if sum.length_squared() > 0.0 { sum.normalize() } else { own }
    })
}

/// Calls `mean` for every frame with the frames near it and their weights; with none where nothing is smoothed.
fn under_bell<T>(
    count: usize,
    times: &[f64],
    deviation_seconds: f64,
    mean: impl Fn(usize, &[(usize, f64)]) -> T,
) -> Vec<T> {
    // A little more than three deviations, so that rounding of the times does not decide on which side a frame is left out.
    let reach = 3.0 * deviation_seconds * (1.0 + 1e-6);
    let (mut first, mut after) = (0, 0);
    let mut near = Vec::new();
    let mut result = Vec::with_capacity(count);
    for (frame, &time) in times.iter().enumerate().take(count) {
        near.clear();
        if deviation_seconds > 0.0 {
            while times[first] < time - reach {
                first += 1;
            }
            while after < times.len() && times[after] <= time + reach {
                after += 1;
            }
            near.extend((first..after).map(|other| {
                let distance = (times[other] - time) / deviation_seconds;
                (other, (-0.5 * distance * distance).exp())
            }));
        }
        result.push(mean(frame, &near));
    }
    result
}

/// Speeds by central differences, in units per second; 0 for a single frame.
pub(super) fn speeds(values: &[DVec3], times: &[f64]) -> Vec<f64> {
    let last = values.len() - 1;
    let speed = |frame: usize| {
        let (before, after) = (frame.saturating_sub(1), (frame + 1).min(last));
        let seconds = times[after] - times[before];
        if seconds > 0.0 { values[after].distance(values[before]) / seconds } else { 0.0 }
    };
    (0..values.len()).map(speed).collect()
}

/// First and last frame of every run of `true`.
pub(super) fn runs(flags: &[bool]) -> Vec<(usize, usize)> {
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
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
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
