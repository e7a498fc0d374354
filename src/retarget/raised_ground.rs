//! Ground above the floor of a clip that feet stand on: stairs, slopes, and captures whose height drifts.
//!
//! A foot that is still above the floor may as well hang in the air. It stands if the body is upright above it, and the other foot moves
//! meanwhile or stands as high: somebody must carry the body.

use super::stages::temporal::{runs, smoothed};

/// Lower is the floor itself, for a leg of 1 m.
const MIN_METERS: f64 = 0.05;
/// A foot that is slower is still, for a leg of 1 m, and one that is faster carries nothing.
const STILL_METERS_PER_SECOND: f64 = 0.2;
const MOVING_METERS_PER_SECOND: f64 = 0.4;
/// A hip is so far above a foot that carries, in legs: of somebody who sits, or kneels, it is not.
const UPRIGHT: f64 = 0.7;
/// A foot is still for so long at least, and carries alone for so long.
const MIN_STILL_SECONDS: f64 = 0.15;
const MIN_ALONE_SECONDS: f64 = 0.1;
/// Two feet stand on the same ground where it differs by less, for a leg of 1 m.
const SAME_METERS: f64 = 0.05;
/// Standard deviation of the smoothing of the ground's height: feet roll on it.
const SMOOTHING_SECONDS: f64 = 0.1;
/// So long before and after, the ground is as high as where the foot is still, so that it is met as it lands and leaves.
const NEAR_SECONDS: f64 = 0.25;

/// One of the two feet of a figure.
pub(in crate::retarget) struct FootHeights<'a> {
    /// How far it is above where it rests on the floor: the lowest of its points.
    pub(in crate::retarget) above_floor: &'a [f64],
    /// Of its ball.
    pub(in crate::retarget) speeds: &'a [f64],
    /// How far the hip is above it.
    pub(in crate::retarget) hip: &'a [f64],
}

/// A foot that is still above the floor: first and last frame.
#[derive(Clone, Copy)]
struct Rest {
    first: usize,
    last: usize,
    carries: bool,
}

/// The floors below both feet, of the levels at which they rest most often: what is known of their soles may be off. A foot that rests much
/// higher than the other does not rest on the floor.
pub(in crate::retarget) fn own_floors(levels: [f64; 2], leg: f64) -> [f64; 2] {
    let lowest = levels[0].min(levels[1]);
    levels.map(|level| if level - lowest > SAME_METERS * leg { lowest } else { level })
}

/// How high the ground is under each foot, frame by frame, above the floor; 0 where the foot is on the floor or in the air, and nothing at
/// all where neither foot ever stands above it. In the units of the heights; `leg` is the length of the leg.
pub(in crate::retarget) fn raised_ground(
    feet: &[FootHeights<'_>; 2],
    times: &[f64],
    leg: f64,
) -> Option<[Vec<f64>; 2]> {
    let mut rests = [0, 1].map(|foot| rests(&feet[foot], times, leg));
    for foot in [0, 1] {
        for rest in &mut rests[foot] {
            rest.carries = carries_alone(rest, &feet[foot], &feet[1 - foot], times, leg);
        }
    }
    for foot in [0, 1] {
        let stands_beside = |rest: &Rest| {
            let is_beside = |of_other: &Rest| {
                let (first, last) = (rest.first.max(of_other.first), rest.last.min(of_other.last));
                let heights = [foot, 1 - foot].map(|foot| feet[foot].above_floor);
                let is_same = |frame: usize| (heights[0][frame] - heights[1][frame]).abs() < SAME_METERS * leg;
                of_other.carries && (first..=last).any(is_same)
            };
            rest.carries || (is_upright(rest, &feet[foot], leg) && rests[1 - foot].iter().any(is_beside))
        };
        let carries: Vec<bool> = rests[foot].iter().map(stands_beside).collect();
        rests[foot].iter_mut().zip(carries).for_each(|(rest, carries)| rest.carries = carries);
    }
    rests.iter_mut().for_each(|rests| rests.retain(|rest| rest.carries));
    let is_raised = rests.iter().any(|rests| !rests.is_empty());
    is_raised.then(|| [0, 1].map(|foot| heights(&rests[foot], feet[foot].above_floor, times)))
}

/// When a foot is still above the floor.
fn rests(foot: &FootHeights<'_>, times: &[f64], leg: f64) -> Vec<Rest> {
    let is_still =
        |frame: usize| foot.speeds[frame] < STILL_METERS_PER_SECOND * leg && foot.above_floor[frame] > MIN_METERS * leg;
    let still: Vec<bool> = (0..times.len()).map(is_still).collect();
    let is_long = |&(first, last): &(usize, usize)| times[last] - times[first] >= MIN_STILL_SECONDS;
    runs(&still).into_iter().filter(is_long).map(|(first, last)| Rest { first, last, carries: false }).collect()
}

fn is_upright(rest: &Rest, foot: &FootHeights<'_>, leg: f64) -> bool {
    foot.hip[rest.first..=rest.last].iter().any(|hip| *hip > UPRIGHT * leg)
}

/// Whether the body is above the foot while the other one moves.
fn carries_alone(rest: &Rest, foot: &FootHeights<'_>, other: &FootHeights<'_>, times: &[f64], leg: f64) -> bool {
    let is_alone =
        |frame: &usize| other.speeds[*frame] > MOVING_METERS_PER_SECOND * leg && foot.hip[*frame] > UPRIGHT * leg;
    let seconds = (rest.first..rest.last).filter(is_alone).map(|frame| times[frame + 1] - times[frame]);
    seconds.sum::<f64>() >= MIN_ALONE_SECONDS
}

/// The height of the ground where a foot rests on it, and for a moment before and after.
fn heights(rests: &[Rest], above_floor: &[f64], times: &[f64]) -> Vec<f64> {
    let mut ground = vec![0.0; times.len()];
    for (index, &Rest { first, last, .. }) in rests.iter().enumerate() {
        let own = smoothed(&above_floor[first..=last], &times[first..=last], SMOOTHING_SECONDS);
        ground[first..=last].copy_from_slice(&own);
        let behind = index.checked_sub(1).map_or(0, |before| rests[before].last + 1);
        let ahead = rests.get(index + 1).map_or(times.len(), |after| after.first);
        let begin = times.partition_point(|time| *time < times[first] - NEAR_SECONDS).max(behind);
        let end = times.partition_point(|time| *time <= times[last] + NEAR_SECONDS).min(ahead);
        ground[begin..first].fill(own[0]);
        ground[last + 1..end].fill(own[last - first]);
    }
    ground
}
