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
/// Of a walk both feet come to rest, and so often. Else one may be in the air for a moment, as in a jump or a fall, unless it is as slow as that
/// for so long, for a leg of 1 m.
const MIN_RESTS: usize = 3;
const SURE_METERS_PER_SECOND: f64 = 0.12;
const SURE_SECONDS: f64 = 0.4;
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
    let is_steady = |foot: usize, rest: &Rest| {
        let slow = (rest.first..rest.last).filter(|frame| feet[foot].speeds[*frame] < SURE_METERS_PER_SECOND * leg);
        slow.map(|frame| times[frame + 1] - times[frame]).sum::<f64>() >= SURE_SECONDS
    };
    let count: usize = rests.iter().map(Vec::len).sum();
    let is_walk = count >= MIN_RESTS && rests.iter().all(|rests| !rests.is_empty());
    let is_sure = is_walk || [0, 1].into_iter().any(|foot| rests[foot].iter().any(|rest| is_steady(foot, rest)));
    is_sure.then(|| [0, 1].map(|foot| heights(&rests[foot], feet[foot].above_floor, times)))
}

/// How high that ground is, over floors at such heights; not a number where a foot is on the floor or in the air.
pub(in crate::retarget) fn over_floors(grounds: [Vec<f64>; 2], floors: [f64; 2]) -> impl Iterator<Item = Vec<f64>> {
    let over = |(ground, floor): (Vec<f64>, f64)| {
        let heights = ground.into_iter().map(|above| if above > 0.0 { floor + above } else { f64::NAN });
        heights.collect()
    };
    grounds.into_iter().zip(floors).map(over)
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

#[cfg(test)]
mod tests {
    use super::*;

    const FRAMES_PER_SECOND: f64 = 30.0;

    /// A foot that is at a height in each span of seconds, and moves up and down between them.
    fn foot(spans: &[(f64, f64, f64)], seconds: f64, hip: f64) -> [Vec<f64>; 3] {
        let frames = (seconds * FRAMES_PER_SECOND) as usize;
        let rests = |time: f64| spans.iter().find(|(from, to, _)| (*from..*to).contains(&time));
        let times = (0..frames).map(|frame| frame as f64 / FRAMES_PER_SECOND);
        let (heights, speeds) =
            times.map(|time| rests(time).map_or((0.5, 1.5), |(_, _, height)| (*height, 0.01))).unzip();
        [heights, speeds, vec![hip; frames]]
    }

    fn heights([above_floor, speeds, hip]: &[Vec<f64>; 3]) -> FootHeights<'_> {
        FootHeights { above_floor, speeds, hip }
    }

    fn ground(left: &[Vec<f64>; 3], right: &[Vec<f64>; 3]) -> Option<[Vec<f64>; 2]> {
        let times: Vec<f64> = (0..left[0].len()).map(|frame| frame as f64 / FRAMES_PER_SECOND).collect();
        raised_ground(&[heights(left), heights(right)], &times, 1.0)
    }

    /// Treads of 17 cm, one foot after the other.
    fn climbing(hip: f64) -> [[Vec<f64>; 3]; 2] {
        let left = foot(&[(0.0, 0.5, 0.0), (0.8, 1.5, 0.34), (1.8, 2.5, 0.68)], 3.0, hip);
        let right = foot(&[(0.3, 1.0, 0.17), (1.3, 2.0, 0.51), (2.3, 3.0, 0.85)], 3.0, hip);
        [left, right]
    }

    #[test]
    fn treads_are_as_high_as_feet_stand_on_them() {
        let [left, right] = climbing(0.95);
        let [of_left, of_right] = ground(&left, &right).expect("stairs");
        let at = |heights: &[f64], seconds: f64| heights[(seconds * FRAMES_PER_SECOND) as usize];
        for (found, wanted) in [
            (at(&of_left, 0.2), 0.0),
            (at(&of_left, 1.1), 0.34),
            (at(&of_left, 2.2), 0.68),
            (at(&of_right, 0.6), 0.17),
            (at(&of_right, 1.7), 0.51),
            (at(&of_right, 2.7), 0.85),
        ] {
            assert!((found - wanted).abs() < 1e-9, "{found} m instead of {wanted} m");
        }
    }

    #[test]
    fn a_foot_that_nobody_stands_on_is_in_the_air() {
        let [left, right] = climbing(0.5);
        assert!(ground(&left, &right).is_none(), "who sits treads on nothing");
        let stands = foot(&[(0.0, 3.0, 0.0)], 3.0, 0.95);
        let raised = foot(&[(0.5, 1.5, 0.3), (1.8, 2.8, 0.3)], 3.0, 0.8);
        assert!(ground(&stands, &raised).is_none(), "on one leg");
        // Both at once, as in a leap that hangs in the air.
        let leap = foot(&[(0.0, 1.0, 0.0), (1.3, 1.7, 0.4), (2.0, 3.0, 0.0)], 3.0, 0.95);
        assert!(ground(&leap, &leap).is_none(), "neither foot moves");
        // A foot that is slow for a moment while the other one kicks.
        let slow = foot(&[(0.0, 1.0, 0.0), (1.2, 1.45, 0.2), (2.0, 3.0, 0.0)], 3.0, 0.95);
        let kicks = foot(&[(0.0, 1.0, 0.0), (2.0, 3.0, 0.0)], 3.0, 0.95);
        assert!(ground(&slow, &kicks).is_none(), "once, for a quarter of a second");
    }

    #[test]
    fn who_steps_onto_a_box_stands_there_with_both_feet() {
        let first = foot(&[(0.0, 0.5, 0.0), (0.9, 3.0, 0.4)], 3.0, 0.95);
        let then = foot(&[(0.0, 1.2, 0.0), (1.8, 3.0, 0.4)], 3.0, 0.95);
        let [one, other] = ground(&first, &then).expect("a box");
        let last = one.len() - 1;
        assert!(
            (one[last] - 0.4).abs() < 1e-9 && (other[last] - 0.4).abs() < 1e-9,
            "{} and {}",
            one[last],
            other[last]
        );
    }
}
