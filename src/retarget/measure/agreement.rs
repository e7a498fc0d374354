//! Whether the target's feet stand while the source's do.

use super::{contacts::intervals, foot_points::Traced, metric::Reading, statistics::frames_per_second, trunk::Resting};

/// A foot that comes or leaves by so much earlier or later than the source's stands with it: nobody sees that, and of short contacts it
/// is all there is.
const NEAR_SECONDS: f64 = 0.05;

/// Contacts that last less, of all points and both sides together, say little: what they differ by is a share of this.
const MIN_SECONDS: f64 = 1.0;

/// 1 − F1 of frames in contact; nothing where the source never stands. `frames` are the clip's frames that are measured. Where a body sits or
/// lies, feet lie too, as thick as they are, and carry nothing.
pub(super) fn disagreement(bearing: &[&Traced<'_>], frames: &[usize], resting: &Resting) -> Option<Reading> {
    let mut reading = Reading::default();
    let (mut all_alone, mut all, mut of_source) = (0, 0, 0);
    for traced in bearing {
        let (source, target) = (&traced.standing.source.stands, &traced.standing.target.stands);
        let mut alone = stands_alone(source, target, &traced.compared.performed_seconds);
        alone.iter_mut().zip(frames).for_each(|(alone, &frame)| *alone &= !resting.is_near(frame));
        let count = |stands: &[bool]| stands.iter().filter(|stands| **stands).count();
        let sum = count(source) + count(target);
        all += sum;
        all_alone += count(&alone);
        of_source += count(source);
        if sum == 0 {
            continue;
        }
        let (part, share) = (format!("{} {}", traced.point.part, traced.point.name), count(&alone) as f64 / sum as f64);
        let longest = intervals(&alone).into_iter().rev().max_by_key(|(first, last)| last - first);
        if let Some((first, _)) = longest {
            reading.worst.push((frames[first], traced.point.joint, part.clone(), share));
        }
        reading.parts.insert(part, share);
    }
    // Where the source never stands there is nothing to agree with.
    let least = MIN_SECONDS * frames_per_second(&bearing.first()?.compared.performed_seconds);
    (of_source > 0).then(|| Reading { value: all_alone as f64 / (all as f64).max(least), ..reading })
}

/// In which frames one side stands while the other neither does nor will within [`NEAR_SECONDS`] or in the next frame, nor did.
fn stands_alone(source: &[bool], target: &[bool], times_seconds: &[f64]) -> Vec<bool> {
    let (near_source, near_target) = (near(source, times_seconds), near(target, times_seconds));
    (0..source.len())
        .map(|frame| source[frame] && !near_target[frame] || target[frame] && !near_source[frame])
        .collect()
}

/// In which frames a point stands, is about to, or has just done so.
fn near(stands: &[bool], times_seconds: &[f64]) -> Vec<bool> {
    let mut near = stands.to_vec();
    for (first, last) in intervals(stands) {
        let begin = times_seconds.partition_point(|time| *time < times_seconds[first] - NEAR_SECONDS);
        let end = times_seconds.partition_point(|time| *time <= times_seconds[last] + NEAR_SECONDS);
        near[begin.min(first.saturating_sub(1))..end.max(last + 2).min(stands.len())].fill(true);
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stands from the first to before the second frame of each pair.
    fn stands(count: usize, spans: &[[usize; 2]]) -> Vec<bool> {
        (0..count).map(|frame| spans.iter().any(|[first, end]| (*first..*end).contains(&frame))).collect()
    }

    fn alone(fps: f64, source: &[[usize; 2]], target: &[[usize; 2]]) -> Vec<(usize, usize)> {
        let times: Vec<f64> = (0..60).map(|frame| frame as f64 / fps).collect();
        intervals(&stands_alone(&stands(60, source), &stands(60, target), &times))
    }

    #[test]
    fn ends_that_nobody_sees_apart_agree() {
        assert_eq!(alone(60.0, &[[10, 20]], &[[7, 23]]), [], "three frames of 60 a second");
        assert_eq!(alone(60.0, &[[10, 20]], &[[5, 20]]), [(5, 6)], "five");
        assert_eq!(alone(12.0, &[[10, 20]], &[[9, 21]]), [], "a frame of any length");
        assert_eq!(alone(12.0, &[[10, 20]], &[[8, 20]]), [(8, 8)], "not two");
    }

    #[test]
    fn what_one_side_lacks_is_apart() {
        assert_eq!(alone(30.0, &[[0, 10], [40, 50]], &[[0, 10]]), [(40, 49)], "a contact that is missed");
        assert_eq!(alone(30.0, &[], &[[3, 9]]), [(3, 8)], "one too many");
        assert_eq!(alone(30.0, &[[0, 60]], &[[0, 60]]), [], "the same");
    }
}
