//! When a point of a foot stands on the floor.
//!
//! By height and speed with hysteresis, both in leg lengths, over a floor that is found from the clip itself: the height at which
//! the point is slow most often. So a clip that was recorded a little off the floor is understood as well.

use glam::DVec3;

use super::statistics::percentile;

/// Height above the floor, in leg lengths: below the first a contact begins, above the second it ends.
pub(super) const HEIGHT_ON: f64 = 0.025;
const HEIGHT_OFF: f64 = 0.05;
/// Points of a foot on ground above the floor are so far above or below its lowest one at most, in leg lengths: on slopes feet are tilted.
const SLOPING: f64 = 0.08;
/// Speed in leg lengths per second, likewise.
const SPEED_ON: f64 = 0.15;
const SPEED_OFF: f64 = 0.3;
/// Frames that a contact lasts at least, and frames of a gap that is closed.
const MIN_FRAMES: usize = 3;
const MAX_GAP: usize = 2;
/// Speeds are taken over about this long, so that the noise of fast captures does not count.
const SPEED_SECONDS: f64 = 1.0 / 30.0;
/// How far above the lowest heights of the clip the floor is looked for, and the height of the window, in leg lengths.
const FLOOR_RANGE: f64 = 0.15;
const FLOOR_WINDOW: f64 = 0.02;
/// More heights than this say no more about the floor.
const MAX_HEIGHTS: usize = 1024;

/// When one point stands.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Standing {
    /// Height of the floor under this point, meters.
    pub(super) level: f64,
    /// Whether it stands, per frame.
    pub(super) stands: Vec<bool>,
    /// Whether it stands and is as slow as a contact begins: the frames over which slide is counted.
    pub(super) is_still: Vec<bool>,
}

impl Standing {
    /// It stands at no time after all.
    pub(super) fn never(&mut self) {
        self.stands.fill(false);
        self.is_still.fill(false);
    }

    /// From which frames on it is still until the next one.
    pub(super) fn still_steps(&self) -> Vec<bool> {
        self.is_still.windows(2).map(|pair| pair[0] && pair[1]).collect()
    }
}

/// Finds when a point stands. Positions are in meters, +Y up, one per time; `leg` is the leg length in meters, above 0.
pub(super) fn find_standing(positions: &[DVec3], times_seconds: &[f64], leg: f64) -> Standing {
    let speeds = speeds(positions, times_seconds, leg);
    let level = floor_level(positions, &speeds, leg);
    standing_at(level, &[], positions, &speeds, leg)
}

/// The same over a floor that is known to be so high.
pub(super) fn find_standing_at(level: f64, positions: &[DVec3], times_seconds: &[f64], leg: f64) -> Standing {
    find_standing_on(level, &[], positions, times_seconds, leg)
}

/// The same where the foot stands on ground above that floor, too: how high that is, frame by frame; not a number where the foot is on the floor or
/// in the air.
pub(super) fn find_standing_on(
    level: f64,
    ground: &[f64],
    positions: &[DVec3],
    times_seconds: &[f64],
    leg: f64,
) -> Standing {
    standing_at(level, ground, positions, &speeds(positions, times_seconds, leg), leg)
}

fn standing_at(level: f64, ground: &[f64], positions: &[DVec3], speeds: &[f64], leg: f64) -> Standing {
    let mut stands = Vec::with_capacity(positions.len());
    // How high the point is where it came to stand, while it does.
    let mut rest: Option<f64> = None;
    for (frame, (position, speed)) in positions.iter().zip(speeds).enumerate() {
        let height = (position.y - level) / leg;
        let (most_height, most_speed) = if rest.is_some() { (HEIGHT_OFF, SPEED_OFF) } else { (HEIGHT_ON, SPEED_ON) };
        let is_raised = ground.get(frame).is_some_and(|ground| (position.y - ground).abs() < SLOPING * leg)
            && rest.is_none_or(|rest| (position.y - rest).abs() < HEIGHT_OFF * leg);
        let on = (height < most_height || is_raised) && *speed < most_speed;
        rest = on.then(|| rest.unwrap_or(position.y));
        stands.push(on);
    }
    close_gaps(&mut stands);
    drop_short(&mut stands);
    let is_still = stands.iter().zip(speeds).map(|(stands, speed)| *stands && *speed < SPEED_ON).collect();
    Standing { level, stands, is_still }
}

/// Runs of frames in which the point stands: first and last frame.
pub(super) fn intervals(stands: &[bool]) -> Vec<(usize, usize)> {
    let mut found: Vec<(usize, usize)> = Vec::new();
    for frame in (0..stands.len()).filter(|frame| stands[*frame]) {
        match found.last_mut() {
            Some((_, last)) if *last + 1 == frame => *last = frame,
            _ => found.push((frame, frame)),
        }
    }
    found
}

/// Speeds in leg lengths per second.
fn speeds(positions: &[DVec3], times_seconds: &[f64], leg: f64) -> Vec<f64> {
    let last = positions.len().saturating_sub(1);
    let duration = times_seconds.last().zip(times_seconds.first()).map_or(0.0, |(last, first)| last - first);
    let step = duration / last.max(1) as f64;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few frames")]
    let reach = if step > 0.0 { (SPEED_SECONDS / 2.0 / step).round().clamp(1.0, 16.0) as usize } else { 1 };
    let speed = |frame: usize| {
        let (before, after) = (frame.saturating_sub(reach), (frame + reach).min(last));
        let seconds = times_seconds[after] - times_seconds[before];
        if seconds > 0.0 { positions[after].distance(positions[before]) / seconds / leg } else { 0.0 }
    };
    (0..positions.len()).map(speed).collect()
}

/// The height at which slow frames are most often, among the lowest; the lowest height where nothing is slow.
fn floor_level(positions: &[DVec3], speeds: &[f64], leg: f64) -> f64 {
    let step = positions.len().div_ceil(MAX_HEIGHTS).max(1);
    let mut all: Vec<f64> = positions.iter().step_by(step).map(|position| position.y).collect();
    let lowest = percentile(&mut all, 0.02);
    let slow = positions.iter().zip(speeds).step_by(step).filter(|(_, speed)| **speed < SPEED_ON);
    let mut slow: Vec<f64> = slow.map(|(position, _)| position.y).collect();
    slow.retain(|height| *height <= lowest + FLOOR_RANGE * leg);
    slow.sort_unstable_by(f64::total_cmp);
    let window = FLOOR_WINDOW * leg;
    let (mut best, mut end) = ((0, lowest), 0);
    for start in 0..slow.len() {
        while end < slow.len() && slow[end] <= slow[start] + window {
            end += 1;
        }
        if end - start > best.0 {
            best = (end - start, slow[start + (end - start) / 2]);
        }
    }
    best.1
}

fn close_gaps(stands: &mut [bool]) {
    let found = intervals(stands);
    for pair in found.windows(2) {
        let (end, begin) = (pair[0].1, pair[1].0);
        if begin - end - 1 <= MAX_GAP {
            stands[end..begin].fill(true);
        }
    }
}

fn drop_short(stands: &mut [bool]) {
    let count = stands.len();
    for (first, last) in intervals(stands) {
        // A contact that the clip's end cuts short may have been longer.
        let is_cut = first == 0 || last + 1 == count;
        if last - first + 1 < MIN_FRAMES && !is_cut {
            stands[first..=last].fill(false);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 30 frames per second: on the floor at `floor` for `still` frames, then through the air for as many, twice.
    fn steps(floor: f64, still: usize) -> (Vec<DVec3>, Vec<f64>) {
        let mut positions = Vec::new();
        for frame in 0..still * 4 {
            let (stage, within) = (frame / still, (frame % still) as f64 / still as f64);
            let lifted = stage % 2 == 1;
            let height = if lifted { floor + 0.15 * (within * std::f64::consts::PI).sin() } else { floor };
            let travel = (stage / 2) as f64 * 0.6 + if lifted { 0.6 * within } else { 0.0 };
            positions.push(DVec3::new(0.0, height, travel));
        }
        let times = (0..positions.len()).map(|frame| frame as f64 / 30.0).collect();
        (positions, times)
    }

    #[test]
    fn steps_are_found_whatever_the_floor() {
        for floor in [0.0, 0.9, -0.03] {
            let (positions, times) = steps(floor, 15);
            let found = find_standing(&positions, &times, 1.0);
            assert!((found.level - floor).abs() < 1e-9, "the floor {floor} is found: {}", found.level);
            let stances = intervals(&found.stands);
            assert_eq!(stances.len(), 2, "two stances: {stances:?}");
            for (stance, (first, last)) in stances.into_iter().enumerate() {
                assert!(first.abs_diff(stance * 30) <= 1 && last.abs_diff(stance * 30 + 14) <= 1, "{first} to {last}");
            }
        }
    }

    #[test]
    fn a_foot_in_the_air_does_not_stand() {
        let positions: Vec<DVec3> = (0..60).map(|frame| DVec3::new(0.0, 0.0, f64::from(frame) * 0.05)).collect();
        let times: Vec<f64> = (0..60).map(|frame| f64::from(frame) / 30.0).collect();
        assert!(intervals(&find_standing(&positions, &times, 1.0).stands).is_empty(), "1.5 m/s is no contact");
    }

    #[test]
    fn short_clips_and_short_gaps() {
        let one = find_standing(&[DVec3::ZERO], &[0.0], 1.0);
        assert_eq!(one.stands, [true], "a single frame on its own floor");
        assert!(find_standing(&[], &[], 1.0).stands.is_empty(), "nothing");
        let mut stands = [true, true, true, false, false, true, true, true, false, false, false, true, false];
        close_gaps(&mut stands);
        drop_short(&mut stands);
        assert_eq!(intervals(&stands), [(0, 7)], "two frames are closed, three are not; one frame alone is dropped");
    }
}
