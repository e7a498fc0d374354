//! How feet and pelvis are moved up and down, smoothly over time.

use glam::DVec2;

use super::{Clearance, FloorStage};
use crate::retarget::stages::{
    temporal::{smoothed, smoothed_above},
    work::Work,
};

/// Standard deviation of the smoothing of what the pelvis follows.
const SHIFT_SECONDS: f64 = 0.16;
/// Where no foot carries, the pelvis leaves the height of the last one within this time, toward what that one needed on the whole: the last
/// moment of a step says little about a leap, or about the end of a clip.
const LEAVE_SECONDS: f64 = 0.3;
/// So much of the time around is the whole of a step.
const STEP_SECONDS: f64 = 0.6;
/// Standard deviation of the smoothing of what a foot is moved beyond the pelvis: a sole of a few points rolls in jolts, one of
/// flesh does not.
const LIFT_SECONDS: f64 = 0.04;
/// The same where a foot stands still: the whole body of a capture may start by a centimeter within a single frame, and knees need not follow.
const NEED_SECONDS: f64 = 0.015;
/// A foot that turns faster than this rolls or turns about a point of its sole, whatever touches; radians a second.
const STILL_RADIANS_PER_SECOND: f64 = 0.7;
/// Standard deviation of the smoothing with which a foot comes to stand still.
const STILL_SECONDS: f64 = 0.02;
/// Rounds in which that smoothing is made up for where a sole is in the floor.
const LIFT_ROUNDS: usize = 2;

/// How far a foot is moved.
#[derive(Clone, Copy)]
pub(in crate::retarget) struct Lift {
    /// Beyond the shift of the pelvis.
    pub(in crate::retarget) beyond: f64,
    /// What it has to be moved by to stay out of the floor.
    pub(in crate::retarget) least: f64,
}

/// Smooth over time, and nowhere less than the least, but where a foot stands still (a share of each frame; nothing where there is no foot): that
/// one is moved by what it needs, and may be in the floor by the millimeters that the start of a capture is smoothed by. Its ankle is as quiet
/// as the floor, however jerkily rotations alone would raise and sink it.
pub(in crate::retarget) fn smoothed_lifts(mut lifts: Vec<Lift>, stands_still: &[f64], times: &[f64]) -> Vec<Lift> {
    let beyond: Vec<f64> = lifts.iter().map(|lift| lift.beyond).collect();
    let least: Vec<f64> = lifts.iter().map(|lift| lift.least).collect();
    let smooth = smooth_above(&beyond, &least, times, LIFT_SECONDS);
    let needed = smoothed(&beyond, times, NEED_SECONDS);
    lifts.iter_mut().zip(&smooth).for_each(|(lift, smooth)| lift.beyond = *smooth);
    for ((lift, needed), still) in lifts.iter_mut().zip(needed).zip(stands_still) {
        lift.beyond += (needed - lift.beyond) * still;
    }
    lifts
}

/// Values smoothed under a bell, and nowhere less than the least.
pub(in crate::retarget) fn smooth_above(
    values: &[f64],
    least: &[f64],
    times: &[f64],
    deviation_seconds: f64,
) -> Vec<f64> {
    let mut smooth = smoothed(values, times, deviation_seconds);
    let missing = |smooth: &[f64]| -> Vec<f64> {
        least.iter().zip(smooth).map(|(least, smooth)| (least - smooth).max(0.0)).collect()
    };
    let add = |smooth: &mut [f64], more: Vec<f64>| {
        smooth.iter_mut().zip(more).for_each(|(smooth, more)| *smooth += more);
    };
    // Smoothing takes the tips off, so what is still missing is added again, as smoothly.
    for _ in 0..LIFT_ROUNDS {
        let more = smoothed(&missing(&smooth), times, deviation_seconds);
        add(&mut smooth, more);
    }
    // The little that is left then goes, too.
    let more = smoothed_above(&missing(&smooth), times, deviation_seconds);
    add(&mut smooth, more);
    smooth
}

impl FloorStage {
    /// How much a foot stands still, frame by frame: 1 well within contacts in which it does not turn.
    pub(in crate::retarget) fn stands_still(&self, foot: usize, work: &Work<'_>) -> Vec<f64> {
        let limb = self.feet[foot].limb;
        let rotation = |frame: usize| work.goals[frame * self.limb_count + limb].rotation;
        let last = work.frame_count().saturating_sub(1);
        let moves = |frame: usize| {
            let (before, after) = (frame.saturating_sub(1), (frame + 1).min(last));
            let most = STILL_RADIANS_PER_SECOND * (work.performed[after] - work.performed[before]);
            let stands = work.contacts.touches(limb, frame) && rotation(before).angle_between(rotation(after)) < most;
            if stands { 0.0 } else { 1.0 }
        };
        let moves: Vec<f64> = (0..work.frame_count()).map(moves).collect();
        smoothed_above(&moves, work.performed, STILL_SECONDS).into_iter().map(|moves| 1.0 - moves).collect()
    }

    /// How far the pelvis goes up or down with the feet that carry it: the mean of what they need; `wants` says what a foot needs at a
    /// frame where it carries. Straight from one contact to the next, and smooth over time: frames in which two feet carry count
    /// twice in that, since two knees bend for what is left. A trunk that rests on the floor decides alone.
    pub(in crate::retarget) fn shifts(
        &self,
        rows: &[Clearance],
        work: &Work<'_>,
        wants: impl Fn(usize, usize, &Clearance) -> Option<f64>,
    ) -> Vec<f64> {
        let width = self.feet.len().max(1);
        let mut known: Vec<(usize, DVec2)> = Vec::new();
        for (frame, row) in rows.chunks_exact(width).enumerate() {
            let lifts = row.iter().enumerate().filter_map(|(foot, clearance)| wants(foot, frame, clearance));
            let sum: DVec2 = lifts.map(|lift| DVec2::new(lift, 1.0)).sum();
            if sum.y > 0.0 {
                known.push((frame, sum));
            }
        }
        let mut shifts = straight(&known, work.performed);
        for (frame, shift) in shifts.iter_mut().enumerate() {
            *shift = work.resting(frame).shift(*shift);
        }
        shifts
    }
}

/// What is known, and what the pelvis goes toward where that ends for longer.
fn with_ends(known: &[(usize, DVec2)], times: &[f64]) -> Vec<(usize, DVec2)> {
    let seconds = |frame: usize| times[frame];
    // The mean of what is near counts like a single frame.
    let mean = |index: usize| {
        let is_near = |other: &&(usize, DVec2)| (seconds(other.0) - seconds(known[index].0)).abs() <= STEP_SECONDS;
        let before = known[..index].iter().rev().take_while(is_near);
        let sum: DVec2 = before.chain(known[index..].iter().take_while(is_near)).map(|known| known.1).sum();
        sum / sum.y
    };
    // So far toward the mean is the pelvis at a frame that is away from a known one.
    let left = |index: usize, frame: usize| {
        let (from, sum) = known[index];
        let share = ((seconds(frame) - seconds(from)).abs() / LEAVE_SECONDS).min(1.0);
        (frame, sum.lerp(mean(index), share))
    };
    let mut whole = Vec::with_capacity(known.len() + 2);
    for (index, &(frame, sum)) in known.iter().enumerate() {
        let before = index.checked_sub(1).map(|before| known[before].0);
        let after = known.get(index + 1).map(|after| after.0);
        let is_long = |from: usize, to: usize| seconds(to) - seconds(from) > 2.0 * LEAVE_SECONDS;
        if before.is_none_or(|before| is_long(before, frame)) {
            let early = times.partition_point(|time| *time < seconds(frame) - LEAVE_SECONDS);
            whole.extend((early < frame).then(|| left(index, early)));
        }
        whole.push((frame, sum));
        if after.is_none_or(|after| is_long(frame, after)) {
            let late = times.partition_point(|time| *time < seconds(frame) + LEAVE_SECONDS).min(times.len() - 1);
            whole.extend((late > frame).then(|| left(index, late)));
        }
    }
    whole
}

/// From one known value to the next, then smooth. Values come as sums of several, with their number.
fn straight(known: &[(usize, DVec2)], times: &[f64]) -> Vec<f64> {
    let known = with_ends(known, times);
    let (Some(first), Some(last)) = (known.first(), known.last()) else { return vec![0.0; times.len()] };
    let mut sums = Vec::with_capacity(times.len());
    let mut next = 0;
    for frame in 0..times.len() {
        while next < known.len() && known[next].0 < frame {
            next += 1;
        }
        let after = known.get(next).unwrap_or(last);
        let before = next.checked_sub(1).map_or(first, |before| &known[before]);
        let span = times[after.0] - times[before.0];
        let share = if span > 0.0 { ((times[frame] - times[before.0]) / span).clamp(0.0, 1.0) } else { 1.0 };
        sums.push(before.1.lerp(after.1, share));
    }
    let smooth = smoothed(&sums, times, SHIFT_SECONDS);
    smooth.into_iter().map(|sum| sum.x / sum.y).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_foot_that_stands_still_is_moved_by_what_it_needs() {
        let times: Vec<f64> = (0..60).map(|frame| f64::from(frame) / 30.0).collect();
        // A crouch: within three frames rotations alone sink the foot by 4 cm, and as fast they raise it again.
        let need = |frame: usize| 0.04 * (1.0 - (frame.abs_diff(30) as f64 / 3.0)).max(0.0);
        let lifts: Vec<Lift> = (0..60).map(|frame| Lift { beyond: need(frame), least: need(frame) }).collect();
        let off = |stands_still: &[f64]| {
            let moved = smoothed_lifts(lifts.clone(), stands_still, &times);
            moved.iter().enumerate().map(|(frame, lift)| (lift.beyond - need(frame)).abs()).fold(0.0, f64::max)
        };
        assert!(off(&[]) > 0.008, "smoothly, it hovers around that: {}", off(&[]));
        assert!(off(&[1.0; 60]) < 0.0035, "it stays on the floor: {}", off(&[1.0; 60]));
        let mut start = lifts.clone();
        start.iter_mut().for_each(|lift| (lift.beyond, lift.least) = (0.0, 0.0));
        start[30].beyond = 0.015;
        let fast: Vec<f64> = times.iter().map(|time| time / 4.0).collect();
        let most = smoothed_lifts(start, &[1.0; 60], &fast).iter().map(|lift| lift.beyond).fold(0.0, f64::max);
        assert!(most < 0.005, "a start of a single frame of a fast capture is not followed: {most}");
    }

    #[test]
    fn where_nothing_carries_the_pelvis_goes_to_what_the_step_needed() {
        let times: Vec<f64> = (0..240).map(|frame| f64::from(frame) / 60.0).collect();
        // A step from frame 100 to 130 in which more and more is needed, 0 on the whole.
        let known: Vec<(usize, DVec2)> =
            (100..131).map(|frame| (frame, DVec2::new(0.01 * (frame as f64 - 115.0), 1.0))).collect();
        let shifts = straight(&known, &times);
        assert!(shifts[0].abs() < 1e-3, "before: {}", shifts[0]);
        assert!(shifts[239].abs() < 1e-3, "behind: {}", shifts[239]);
        assert!(shifts[108] < -0.02 && shifts[122] > 0.02, "within: {} and {}", shifts[108], shifts[122]);
        let steps = shifts.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        assert!(steps < 0.012, "smoothly: {steps}");
        assert_eq!(straight(&[], &times), vec![0.0; 240], "nothing carries at all");
        let end: Vec<(usize, DVec2)> = (230..240).map(|frame| (frame, DVec2::new(0.1, 2.0))).collect();
        assert!(straight(&end, &times).iter().all(|shift| (shift - 0.05).abs() < 1e-12), "what is even stays");
    }
}
