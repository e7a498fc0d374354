//! Finding the part of a clip after which its poses come back.
//!
//! Poses are compared by the local rotations of all joints but the one that carries the figure, each weighed by how much hangs below it,
//! so that where the figure stands and faces does not matter. The cycle is the shortest lag after which the poses of the whole clip
//! come back nearly as well as after any; it begins where the two ends fit best. (docs/algorithm/clips.md.)

use glam::{DQuat, Quat};

use crate::model::{Canceled, Clip, Control, Skeleton, Track};

use super::looping::carrier;

/// The lag is looked for in so many frames at most; what is found is then looked at frame by frame.
const MAX_FRAMES: usize = 400;
/// Shorter lags are no cycles but poses that hardly change. Seconds.
const MIN_SECONDS: f64 = 0.2;
/// Poses come back where their distance is at most this share of the largest.
const COMES_BACK: f64 = 0.45;
/// The shortest lag that comes back this much worse than the best one is taken.
const NEARLY_AS_WELL: f64 = 1.5;
/// The lag may differ by this share where the ends fit better.
const SLACK: f64 = 0.12;

/// Cycles of a clip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Where it begins and ends, on the clip's own clock.
    pub seconds: [f64; 2],
    /// How much the poses at its ends differ: the weighted mean angle of all joints, in degrees.
    pub seam_degrees: f64,
}

/// Finds so many whole cycles that follow each other; nothing where the poses do not come back, or not as often.
///
/// # Errors
/// When the work is canceled.
pub fn find_cycles(
    clip: &Clip,
    skeleton: &Skeleton,
    cycles: u32,
    control: &Control,
) -> Result<Option<Cycle>, Canceled> {
    let poses = Poses::new(clip, skeleton);
    let times = clip.times_seconds();
    let frames = times.len();
    if frames < 4 || poses.joints.is_empty() || cycles == 0 {
        return Ok(None);
    }
    let stride = frames.div_ceil(MAX_FRAMES);
    let coarse: Vec<usize> = (0..frames).step_by(stride).collect();
    let step = (times[coarse[coarse.len() - 1]] - times[0]) / (coarse.len() - 1) as f64;
    let mut differences = vec![0.0; coarse.len()];
    // At least a third of the clip is compared with itself.
    let most = (coarse.len() * 2 / 3).max(1);
    for (lag, difference) in differences.iter_mut().enumerate().take(most).skip(1) {
        control.check()?;
        let pairs = coarse.iter().zip(&coarse[lag..]);
        let count = pairs.len() as f64;
        *difference = pairs.map(|(first, second)| poses.difference(*first, *second)).sum::<f64>() / count;
    }
    let largest = differences.iter().copied().fold(0.0, f64::max);
    let least = ((MIN_SECONDS / step).ceil() as usize).max(2);
    let is_valley = |lag: usize| differences[lag] <= differences[lag - 1] && differences[lag] <= differences[lag + 1];
    let valleys: Vec<usize> = (least..most.saturating_sub(1))
        .filter(|lag| is_valley(*lag) && differences[*lag] <= COMES_BACK * largest)
        .collect();
    let Some(best) = valleys.iter().map(|lag| differences[*lag]).min_by(f64::total_cmp) else { return Ok(None) };
    let lag = valleys.into_iter().find(|lag| differences[*lag] <= NEARLY_AS_WELL * best);
    let Some(wanted) = lag.map(|lag| lag as f64 * step * f64::from(cycles)) else { return Ok(None) };
    let mut found: Option<Cycle> = None;
    for first in 0..frames {
        control.check()?;
        let low = times.partition_point(|time| *time < times[first] + wanted * (1.0 - SLACK));
        let high = times.partition_point(|time| *time <= times[first] + wanted * (1.0 + SLACK));
        for second in low..high {
            let seam_degrees = poses.difference(first, second).to_degrees();
            if found.is_none_or(|found| seam_degrees < found.seam_degrees) {
                found = Some(Cycle { seconds: [times[first], times[second]], seam_degrees });
            }
        }
    }
    Ok(found)
}

/// The rotations that are compared.
struct Poses<'a> {
    joints: Vec<(&'a [Quat], f64)>,
}

impl<'a> Poses<'a> {
    fn new(clip: &'a Clip, skeleton: &Skeleton) -> Self {
        let mut below = vec![1.0; skeleton.len()];
        for joint in (0..skeleton.len()).rev() {
            if let Some(parent) = skeleton.parent(joint) {
                below[parent] += below[joint];
            }
        }
        let carrier = carrier(clip);
        let is_above = |joint: usize| carrier.is_some_and(|carrier| skeleton.is_ancestor_or_self(joint, carrier));
        let joints = clip.joints().iter().enumerate().filter_map(|(joint, tracks)| match &tracks.rotation {
            // A finger counts for less than the arm that carries it.
            Track::Sampled(values) if !is_above(joint) => Some((values.as_slice(), f64::sqrt(below[joint]))),
            _ => None,
        });
        Self { joints: joints.collect() }
    }

    /// The weighted mean angle between the rotations of two frames, in radians.
    fn difference(&self, first: usize, second: usize) -> f64 {
        let (sum, weights) = self.joints.iter().fold((0.0, 0.0), |(sum, weights), (values, weight)| {
            (sum + weight * angle(values[first].as_dquat(), values[second].as_dquat()), weights + weight)
        });
        sum / weights
    }
}

fn angle(first: DQuat, second: DQuat) -> f64 {
    // |p − q| of unit quaternions is twice the sine of a quarter of the angle; near enough below half a turn.
    2.0 * (first - second).length().min((first + second).length())
}
