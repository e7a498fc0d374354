//! Takes noise off rotations. (retargeting.md B24.)

use std::f64::consts::TAU;

use glam::{DQuat, DVec4, Quat};
use rayon::prelude::*;

use crate::{
    model::{Canceled, Clip, ClipError, Control, JointTracks, Track},
    rig::{FilterKind, FilterOp, Schedule},
};

use super::{temporal::smoothed_rotations, work::Work};

/// The cutoff of the filter of the angular speed itself, Hz.
const SPEED_CUTOFF: f64 = 1.0;

/// The clip with the local rotations of these joints filtered.
///
/// # Errors
/// The outer one when the work is canceled, the inner one when the result does not fit into tracks.
pub fn filtered(
    clip: &Clip,
    op: &FilterOp,
    schedule: Schedule,
    joints: Vec<usize>,
    control: &Control,
) -> Result<Result<Clip, ClipError>, Canceled> {
    let stage = FilterStage { op: op.clone(), schedule, joints };
    let mut tracks = clip.joints().to_vec();
    stage.apply(&mut tracks, clip.times_seconds(), control)?;
    Ok(clip.clone().with_joints(tracks))
}

/// Filters the local rotations of some joints.
#[derive(Clone, Debug)]
pub(super) struct FilterStage {
    pub(super) op: FilterOp,
    pub(super) schedule: Schedule,
    pub(super) joints: Vec<usize>,
}

impl FilterStage {
    pub(super) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        self.apply(&mut work.target, work.times, work.control)
    }

    fn apply(&self, tracks: &mut [JointTracks], times: &[f64], control: &Control) -> Result<(), Canceled> {
        let filtered: Vec<Option<Vec<Quat>>> = self
            .joints
            .par_iter()
            .map(|&joint| {
                control.check()?;
                let Track::Sampled(rotations) = &tracks[joint].rotation else { return Ok(None) };
                Ok(Some(self.filter(rotations, times)))
            })
            .collect::<Result<_, Canceled>>()?;
        for (&joint, rotations) in self.joints.iter().zip(filtered) {
            if let Some(rotations) = rotations {
                tracks[joint].rotation = Track::Sampled(rotations);
            }
        }
        Ok(())
    }

    fn filter(&self, rotations: &[Quat], times: &[f64]) -> Vec<Quat> {
        let rotations: Vec<DQuat> = rotations.iter().map(|rotation| rotation.as_dquat()).collect();
        let filtered = match self.op.kind {
            FilterKind::Bell => smoothed_rotations(&rotations, times, self.op.seconds),
            FilterKind::OneEuro => {
                let forward = self.one_euro(&rotations, times);
                let reversed: Vec<DQuat> = rotations.iter().rev().copied().collect();
                let reversed_times: Vec<f64> = times.iter().rev().map(|time| -time).collect();
                let backward = self.one_euro(&reversed, &reversed_times);
                forward
                    .iter()
                    .zip(backward.iter().rev())
                    .map(|(forward, backward)| forward.slerp(*backward, 0.5))
                    .collect()
            }
        };
        let mut before = Quat::IDENTITY;
        let blend = |(frame, (own, filtered)): (usize, (&DQuat, &DQuat))| {
            let rotation = own.slerp(*filtered, self.schedule.alpha_at(frame, times[frame])).normalize().as_quat();
            before = if rotation.dot(before) < 0.0 { -rotation } else { rotation };
            before
        };
        rotations.iter().zip(&filtered).enumerate().map(blend).collect()
    }

    /// One pass: a low pass whose cutoff rises with the angular speed.
    fn one_euro(&self, rotations: &[DQuat], times: &[f64]) -> Vec<DQuat> {
        let Some(&first) = rotations.first() else { return Vec::new() };
        let (mut filtered, mut speed) = (first, 0.0);
        let share = |cutoff: f64, seconds: f64| 1.0 / (1.0 + 1.0 / (TAU * cutoff * seconds));
        let mut result = vec![first];
        for (pair, times) in rotations.windows(2).zip(times.windows(2)) {
            let seconds = times[1] - times[0];
            let turn = DVec4::from(pair[0].conjugate() * pair[1]);
            let angle = 2.0 * turn.truncate().length().atan2(turn.w.abs());
            speed += (angle / seconds - speed) * share(SPEED_CUTOFF, seconds);
            let cutoff = self.op.min_frequency + self.op.responsiveness * speed;
            filtered = filtered.slerp(pair[1], share(cutoff, seconds)).normalize();
            result.push(filtered);
        }
        result
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filtered(kind: FilterKind, rotations: &[Quat], times: &[f64]) -> Vec<Quat> {
        let schedule = Schedule { alpha: vec![[0.0, 1.0]], frames: [0, rotations.len()] };
        FilterStage { op: FilterOp { kind, ..FilterOp::default() }, schedule, joints: Vec::new() }
            .filter(rotations, times)
    }

    #[test]
    fn noise_goes_and_motion_stays_in_time() {
        let times: Vec<f64> = (0..121).map(|frame| f64::from(frame) / 60.0).collect();
        let angle = |time: f64| 0.6 * (time * 4.0).sin();
        let noisy: Vec<Quat> = times
            .iter()
            .enumerate()
            .map(|(frame, time)| {
                let noise = if frame % 2 == 0 { 0.02 } else { -0.02 };
                DQuat::from_rotation_y(angle(*time) + noise).as_quat()
            })
            .collect();
        for kind in [FilterKind::Bell, FilterKind::OneEuro] {
            let result = filtered(kind, &noisy, &times);
            let jolts = |rotations: &[Quat]| -> f32 {
                rotations
                    .windows(3)
                    .map(|three| (three[0] * three[1].conjugate()).angle_between(three[1] * three[2].conjugate()))
                    .sum()
            };
            assert!(jolts(&result) < jolts(&noisy) / 2.0, "{kind:?}: {} of {}", jolts(&result), jolts(&noisy));
            for frame in 20..100 {
                let wanted = DQuat::from_rotation_y(angle(times[frame])).as_quat();
                let off = result[frame].angle_between(wanted);
                assert!(off < 0.06, "{kind:?}: frame {frame} is off by {off}");
            }
        }
    }

    #[test]
    fn what_rests_stays() {
        let still = vec![Quat::from_rotation_x(0.4); 9];
        let times: Vec<f64> = (0..9).map(|frame| f64::from(frame) / 30.0).collect();
        for kind in [FilterKind::Bell, FilterKind::OneEuro] {
            let worst =
                filtered(kind, &still, &times).iter().map(|rotation| rotation.dot(still[0])).fold(1.0, f32::min);
            assert!(worst > 1.0 - 1e-6, "{kind:?}: {worst}");
        }
        assert_eq!(filtered(FilterKind::OneEuro, &still[..1], &times[..1]).len(), 1, "one frame");
    }
}
