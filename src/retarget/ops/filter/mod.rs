//! Takes noise off rotations. (docs/algorithm/clips.md.)

mod butterworth;
mod local_polynomial;
mod one_euro;
pub(in crate::retarget) mod spec;
mod vector_median;

pub use self::spec::{FilterKind, FilterOp};

use crate::retarget::stages::stage::Stage;
use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::Context,
        op_spec::OpSpec,
        resolved::{OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};
use crate::rig::{
    auto_map::{known_names, roles_of},
    error::{SpecErrorKind, SpecField},
    leg_rows::is_whole_leg,
    rig::Rig,
};
use glam::{DQuat, Quat};
use rayon::prelude::*;

use super::schedule::Schedule;
use crate::model::{Canceled, Clip, ClipError, Control, JointTracks, Track, rotation::join_hemispheres};

use crate::retarget::stages::{clock::Moment, temporal::smoothed_rotations, work::Work};
use butterworth::butterworth;
use local_polynomial::local_polynomial;
use one_euro::one_euro;
use vector_median::vector_median;

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
    let times = clip.times_seconds();
    stage.apply(&mut tracks, times, |frame| Moment { frame, seconds: times[frame] }, control)?;
    Ok(clip.clone().with_joints(tracks))
}

/// Filters the local rotations of some joints.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FilterStage {
    pub(in crate::retarget) op: FilterOp,
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) joints: Vec<usize>,
}

impl FilterStage {
    fn apply(
        &self,
        tracks: &mut [JointTracks],
        times: &[f64],
        moment: impl Fn(usize) -> Moment + Sync,
        control: &Control,
    ) -> Result<(), Canceled> {
        let filtered: Vec<Option<Vec<Quat>>> = self
            .joints
            .par_iter()
            .map(|&joint| {
                control.check()?;
                let Track::Sampled(rotations) = &tracks[joint].rotation else { return Ok(None) };
                Ok(Some(self.filter(rotations, times, &moment)))
            })
            .collect::<Result<_, Canceled>>()?;
        for (&joint, rotations) in self.joints.iter().zip(filtered) {
            if let Some(rotations) = rotations {
                tracks[joint].rotation = Track::Sampled(rotations).on_one_hemisphere();
            }
        }
        Ok(())
    }

    fn filter(&self, rotations: &[Quat], times: &[f64], moment: impl Fn(usize) -> Moment) -> Vec<Quat> {
        let rotations = rotations.iter().map(|rotation| rotation.as_dquat().normalize()).collect();
        let rotations: Vec<DQuat> = on_one_hemisphere(rotations);
        let filtered = match self.op.kind {
            FilterKind::Bell => smoothed_rotations(&rotations, times, self.op.seconds),
            FilterKind::OneEuro => one_euro(&rotations, times, self.op.min_frequency, self.op.responsiveness),
            FilterKind::SavitzkyGolay => {
                local_polynomial(&rotations, times, self.op.reach_frames as usize, self.op.degree as usize)
            }
            FilterKind::Butterworth => butterworth(&rotations, times, self.op.cutoff_hertz),
            FilterKind::Median => vector_median(&rotations, self.op.reach_frames as usize),
        };
        let blend = |(frame, (own, filtered)): (usize, (&DQuat, &DQuat))| {
            own.slerp(*filtered, self.schedule.alpha_at(moment(frame))).normalize().as_quat()
        };
        rotations.iter().zip(&filtered).enumerate().map(blend).collect()
    }
}

impl Stage for FilterStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let mut target = std::mem::take(&mut work.target);
        let done = self.apply(&mut target, work.times, |frame| work.moment(frame), work.control);
        work.target = target;
        done
    }
}

/// The same rotations, each on the hemisphere of the one before.
fn on_one_hemisphere(mut rotations: Vec<DQuat>) -> Vec<DQuat> {
    join_hemispheres(&mut rotations);
    rotations
}

/// A `filter` op and the joints that it filters.
#[derive(Clone, Debug)]
struct ResolvedFilter {
    op: FilterOp,
    joints: Vec<usize>,
}

impl OpWork for ResolvedFilter {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let (op, schedule, joints) = (self.op.clone(), op.schedule.clone(), self.joints.clone());
        stack.push(FilterStage { op, schedule, joints });
    }

    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        self.joints.clone()
    }
}

impl OpSpec for FilterOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let joints = filtered_joints(&self.scope, context.index, context.target, context.mapping, context.fields);
        context.push(&self.scope, ResolvedFilter { op: self.clone(), joints });
    }
}

/// The driven joints of the masked roles; all but those of the legs where nothing is masked.
fn filtered_joints(
    scope: &Scope,
    index: usize,
    target: &Rig<'_>,
    mapping: &Mapping,
    fields: &mut Vec<SpecField>,
) -> Vec<usize> {
    let driven = mapping.driven();
    let joints_of = |name: &str| -> Vec<usize> {
        roles_of(name).into_iter().flat_map(|role| target.role(role).iter().copied()).collect()
    };
    let Some(mask) = &scope.mask else {
        let legs: Vec<usize> =
            ["left_leg", "right_leg", "left_toe", "right_toe"].into_iter().flat_map(joints_of).collect();
        let of_animals = target.roles.iter().filter(|(role, _)| is_whole_leg(role)).flat_map(|(_, joints)| joints);
        let legs: Vec<usize> = legs.into_iter().chain(of_animals.copied()).collect();
        return (0..driven.len()).filter(|joint| driven[*joint] && !legs.contains(joint)).collect();
    };
    let mut wanted = Vec::new();
    for (position, name) in mask.iter().enumerate() {
        let joints = joints_of(name);
        if joints.is_empty() {
            let detail = format!("the target rig has no role '{name}' to mask");
            let pointer = format!("/ops/{index}/mask/{position}");
            let known = known_names(target);
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(name, known.iter().map(String::as_str)));
        }
        wanted.extend(joints);
    }
    (0..driven.len()).filter(|joint| driven[*joint] && wanted.contains(joint)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: [FilterKind; 5] =
        [FilterKind::Bell, FilterKind::OneEuro, FilterKind::SavitzkyGolay, FilterKind::Butterworth, FilterKind::Median];

    fn filtered(kind: FilterKind, rotations: &[Quat], times: &[f64]) -> Vec<Quat> {
        let schedule = Schedule { alpha: vec![[0.0, 1.0]], frames: [0, rotations.len()] };
        FilterStage { op: FilterOp { kind, ..FilterOp::default() }, schedule, joints: Vec::new() }.filter(
            rotations,
            times,
            |frame| Moment { frame, seconds: times[frame] },
        )
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
        for kind in [FilterKind::Bell, FilterKind::OneEuro, FilterKind::SavitzkyGolay, FilterKind::Butterworth] {
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
    fn turning_round_and_round_is_left_alone() {
        // 50 degrees a frame, about an axis that no component of a quaternion lies along.
        let turn =
            |frame: u8| Quat::from_axis_angle(glam::Vec3::new(0.6, 0.0, 0.8), f32::from(frame) * 50.0_f32.to_radians());
        let spin: Vec<Quat> = (0..60).map(turn).collect();
        let times: Vec<f64> = (0..60).map(|frame| f64::from(frame) / 30.0).collect();
        for kind in [FilterKind::SavitzkyGolay, FilterKind::Butterworth, FilterKind::Median] {
            let result = filtered(kind, &spin, &times);
            let worst = (12..48).map(|frame| result[frame].angle_between(spin[frame])).fold(0.0, f32::max);
            assert!(worst < 0.02, "{kind:?}: {worst} radians off");
            assert!(result.windows(2).all(|pair| pair[0].dot(pair[1]) >= 0.0), "{kind:?}: no sign flips");
        }
    }

    #[test]
    fn what_rests_stays() {
        let still = vec![Quat::from_rotation_x(0.4); 9];
        let times: Vec<f64> = (0..9).map(|frame| f64::from(frame) / 30.0).collect();
        for kind in ALL {
            let worst =
                filtered(kind, &still, &times).iter().map(|rotation| rotation.dot(still[0])).fold(1.0, f32::min);
            assert!(worst > 1.0 - 1e-6, "{kind:?}: {worst}");
        }
        for kind in ALL {
            for frames in 0..3 {
                let few = filtered(kind, &still[..frames], &times[..frames]);
                assert!(
                    few.iter().all(|rotation| rotation.is_normalized()) && few.len() == frames,
                    "{kind:?}: {few:?}"
                );
            }
        }
    }
}
