//! At which times a clip is sampled. Pure arithmetic on key times; knows no parser.
//!
//! The file's own keys are kept wherever straight lines between them say what its curves say: where the curves are
//! linear, or keyed so densely that nothing happens between. Otherwise the keys are joined with a uniform grid.

/// Keys closer together than this are one: exporters round the same frame differently from curve to curve.
const SAME_KEY_SECONDS: f64 = 1e-3;
/// The same as a part of a frame, for high frame rates.
const SAME_KEY_FRAMES: f64 = 0.05;
/// Keys whose median spacing is at most this many frames need no grid.
const DENSE_FRAMES: f64 = 1.5;

/// What the curves of an animation stack say about time.
#[derive(Debug, Default)]
pub(super) struct KeyFacts {
    /// The key times of all curves, in any order, repeated ones included; finite.
    pub(super) keys_seconds: Vec<f64>,
    /// Whether interpolating between the keys of all curves at once gives what the file says.
    pub(super) is_linear: bool,
    /// Whether a curve goes on moving before its first or after its last key.
    pub(super) extrapolates: bool,
    /// Begin and end of the stack; nothing where it gives no usable span.
    pub(super) span_seconds: Option<(f64, f64)>,
}

/// When to sample, and what had to be done to the file's keys.
#[derive(Debug, PartialEq)]
pub(super) struct KeyTimes {
    /// Rising; empty only where there is no key.
    pub(super) seconds: Vec<f64>,
    /// Keys before the begin or after the end of the stack, which are not played.
    pub(super) left_out: usize,
    /// Whether a grid was joined with the keys.
    pub(super) grid: Grid,
}

/// Whether a grid was joined with the keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Grid {
    /// The keys say it all.
    NotNeeded,
    /// The keys were joined with frames at the file's rate.
    Joined,
    /// It was needed, but has more frames than the limit.
    TooLong,
}

/// Chooses the sample times. `fps` is finite and positive.
pub(super) fn key_times(facts: KeyFacts, fps: f64, most_frames: u64) -> KeyTimes {
    let same = SAME_KEY_SECONDS.min(SAME_KEY_FRAMES / fps);
    let keys = merge(facts.keys_seconds, same);
    let (Some(first), Some(last)) = (keys.first().copied(), keys.last().copied()) else {
        return KeyTimes { seconds: Vec::new(), left_out: 0, grid: Grid::NotNeeded };
    };
    let overlaps = |(begin, end): &(f64, f64)| *begin < last + same && first < *end + same;
    let span = facts.span_seconds.filter(overlaps);
    let (begin, end) = span.unwrap_or((first, last));
    let all = keys.len();
    let mut keys: Vec<f64> = keys.into_iter().filter(|key| begin - same <= *key && *key <= end + same).collect();
    let left_out = all - keys.len();
    // A span that cuts through the keys begins and ends with frames of its own.
    if first < begin - same {
        keys.push(begin);
    }
    if end + same < last {
        keys.push(end);
    }
    let keys = merge(keys, same);
    let covered =
        keys.first().is_some_and(|key| *key <= begin + same) && keys.last().is_some_and(|key| end - same <= *key);
    let says_it_all = facts.is_linear || median_gap(&keys).is_none_or(|gap| gap <= DENSE_FRAMES / fps);
    if says_it_all && (covered || !facts.extrapolates) {
        return KeyTimes { seconds: keys, left_out, grid: Grid::NotNeeded };
    }
    let intervals = ((end - begin) * fps).round();
    if intervals.is_nan() || intervals + keys.len() as f64 >= most_frames as f64 {
        return KeyTimes { seconds: keys, left_out, grid: Grid::TooLong };
    }
    let intervals = intervals as u64;
    let mut joined = keys;
    joined.extend((0..intervals).map(|frame| begin + frame as f64 / fps));
    joined.push(end);
    KeyTimes { seconds: merge(joined, same), left_out, grid: Grid::Joined }
}

/// Sorts, and makes one of times that are closer than `same` to the first of their group. The last of a group stands for
/// it, so that every step in the group has happened.
fn merge(mut times: Vec<f64>, same: f64) -> Vec<f64> {
    times.sort_by(f64::total_cmp);
    let mut merged: Vec<f64> = Vec::with_capacity(times.len());
    let mut group_begin = f64::NEG_INFINITY;
    for time in times {
        if time - group_begin < same {
            if let Some(last) = merged.last_mut() {
                *last = time;
            }
        } else {
            group_begin = time;
            merged.push(time);
        }
    }
    merged
}

fn median_gap(keys: &[f64]) -> Option<f64> {
    let mut gaps: Vec<f64> = keys.windows(2).map(|pair| pair[1] - pair[0]).collect();
    gaps.sort_by(f64::total_cmp);
    gaps.get(gaps.len() / 2).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(keys: &[f64], span: Option<(f64, f64)>) -> KeyFacts {
        KeyFacts { keys_seconds: keys.to_vec(), is_linear: false, extrapolates: false, span_seconds: span }
    }

    #[test]
    fn dense_keys_are_kept_as_they_are() {
        let keys: Vec<f64> = (0..31).map(|frame| f64::from(frame) / 30.0).collect();
        let times = key_times(facts(&keys, Some((0.0, 1.0))), 30.0, 1000);
        assert_eq!(times, KeyTimes { seconds: keys, left_out: 0, grid: Grid::NotNeeded }, "unchanged");
    }

    #[test]
    fn sparse_keys_are_joined_with_a_grid_that_ends_at_the_end() {
        let times = key_times(facts(&[0.0, 0.51], Some((0.0, 1.02))), 10.0, 1000);
        assert_eq!(times.grid, Grid::Joined, "a grid is needed");
        assert_eq!(times.seconds.len(), 12, "ten grid frames, the end and the key off the grid: {:?}", times.seconds);
        assert_eq!(times.seconds.last(), Some(&1.02), "the last frame is at the end");
    }

    #[test]
    fn linear_keys_need_no_grid() {
        let linear = KeyFacts { is_linear: true, ..facts(&[0.0, 5.0], Some((0.0, 5.0))) };
        assert_eq!(key_times(linear, 30.0, 1000).seconds, [0.0, 5.0], "two keys");
        let repeats = KeyFacts { is_linear: true, extrapolates: true, ..facts(&[0.0, 1.0], Some((0.0, 2.0))) };
        assert_eq!(
            key_times(repeats, 30.0, 1000).seconds.len(),
            61,
            "a curve that repeats needs frames where it has no keys"
        );
    }

    #[test]
    fn keys_outside_the_stack_are_not_played() {
        let keys = [0.0, 0.1, 0.2, 0.3, 0.9];
        let times = key_times(facts(&keys, Some((0.1, 0.35))), 10.0, 1000);
        assert_eq!(times.seconds, [0.1, 0.2, 0.3, 0.35], "cut at both sides, with a frame at the end");
        assert_eq!(times.left_out, 2, "counted");
        let elsewhere = key_times(facts(&keys, Some((7.0, 8.0))), 10.0, 1000);
        assert_eq!(elsewhere.seconds.len(), 5, "a span without any key is not believed");
    }

    #[test]
    fn a_grid_past_the_limit_is_not_made() {
        let times = key_times(facts(&[-166_666.0, 0.0, 166_666.0], None), 30.0, 216_000);
        assert_eq!((times.grid, times.seconds.len()), (Grid::TooLong, 3), "the keys stay");
    }
}
