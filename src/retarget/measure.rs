//! What a retarget gave, measured against the source.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::{
    model::{Clip, Skeleton, Transform},
    rig::{Mapping, Rig},
};

/// Limbs whose direction is compared: role of the start, roles of the end in order of preference.
const LIMBS: [(&str, &[&str]); 10] = [
    ("spine", &["neck", "head"]),
    ("neck", &["head"]),
    ("left_upper_arm", &["left_forearm"]),
    ("left_forearm", &["left_hand"]),
    ("right_upper_arm", &["right_forearm"]),
    ("right_forearm", &["right_hand"]),
    ("left_thigh", &["left_shin"]),
    ("left_shin", &["left_foot"]),
    ("right_thigh", &["right_shin"]),
    ("right_shin", &["right_foot"]),
];

/// Frames that are looked at in a summary; more are spread evenly.
const FRAMES_LOOKED_AT: usize = 1000;

/// What was measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measures {
    /// Angle between the directions of source and target limbs, by role.
    pub limb_directions: BTreeMap<String, LimbDirection>,
    /// 95th percentile over all limbs and frames, degrees.
    pub limb_direction_p95_degrees: f64,
    /// Largest change of any bone's length against the target's rest, as a share of it.
    pub bone_length_drift: f64,
    /// Target pelvis height over source pelvis height.
    pub pelvis_scale: f64,
    /// How many frames were looked at.
    pub frames_measured: usize,
}

/// The direction error of one limb over the clip, in degrees.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct LimbDirection {
    /// Mean.
    pub mean_degrees: f64,
    /// 95th percentile.
    pub p95_degrees: f64,
    /// Largest.
    pub max_degrees: f64,
    /// Frame of the largest.
    pub worst_frame: usize,
    /// One value per measured frame; only in a full report.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub frames_degrees: Vec<f64>,
}

/// Compares the result with the source. `per_frame` keeps the value of every measured frame and looks at all frames.
#[must_use]
pub fn measure(
    mapping: &Mapping,
    source: &Rig<'_>,
    target: &Rig<'_>,
    source_clip: &Clip,
    result: &Clip,
    per_frame: bool,
) -> Measures {
    let limbs: Vec<Limb> = LIMBS.iter().filter_map(|(start, ends)| Limb::find(start, ends, source, target)).collect();
    let frames = source_clip.frame_count();
    let step = if per_frame { 1 } else { frames.div_ceil(FRAMES_LOOKED_AT).max(1) };
    let looked_at: Vec<usize> = (0..frames).step_by(step).collect();
    let mut angles: Vec<Vec<f64>> = vec![Vec::with_capacity(looked_at.len()); limbs.len()];
    let mut bone_length_drift: f64 = 0.0;
    // Joints that ride another joint than their parent stay as far from that one as they were, not from their parent.
    let mut driven = mapping.driven();
    mapping.rides.iter().for_each(|ride| driven[ride.joint] = false);
    for &frame in &looked_at {
        let source_pose = source_clip.local_pose(source.skeleton(), frame).to_model(source.skeleton());
        let local = result.local_pose(target.skeleton(), frame);
        let target_pose = local.to_model(target.skeleton());
        for (limb, angles) in limbs.iter().zip(&mut angles) {
            let wanted = mapping.target_from_source() * limb.direction(source_pose.transforms(), limb.source);
            let found = limb.direction(target_pose.transforms(), limb.target);
            angles.push(wanted.angle_between(found).to_degrees());
        }
        let drift = length_drift(target.skeleton(), local.transforms(), &driven, mapping);
        bone_length_drift = bone_length_drift.max(drift);
    }
    let mut all: Vec<f64> = angles.iter().flatten().copied().filter(|angle| angle.is_finite()).collect();
    let limb_directions = limbs
        .into_iter()
        .zip(angles)
        .map(|(limb, angles)| (limb.role, LimbDirection::from_angles(angles, &looked_at, per_frame)))
        .collect();
    Measures {
        limb_directions,
        limb_direction_p95_degrees: percentile(&mut all, 0.95),
        bone_length_drift,
        pelvis_scale: mapping.global_scale,
        frames_measured: looked_at.len(),
    }
}

struct Limb {
    role: String,
    source: (usize, usize),
    target: (usize, usize),
}

impl Limb {
    fn find(start: &str, ends: &[&str], source: &Rig<'_>, target: &Rig<'_>) -> Option<Self> {
        let end = ends.iter().find(|end| !source.role(end).is_empty() && !target.role(end).is_empty())?;
        let joints = |side: &Rig<'_>| Some((*side.role(start).first()?, *side.role(end).first()?));
        Some(Self { role: start.to_string(), source: joints(source)?, target: joints(target)? })
    }

    fn direction(&self, pose: &[Transform], (start, end): (usize, usize)) -> glam::DVec3 {
        pose[end].translation - pose[start].translation
    }
}

impl LimbDirection {
    fn from_angles(angles: Vec<f64>, frames: &[usize], keep: bool) -> Self {
        let worst = angles.iter().enumerate().max_by(|first, second| first.1.total_cmp(second.1));
        let (worst_frame, max_degrees) = worst.map_or((0, 0.0), |(index, angle)| (frames[index], *angle));
        let mut sorted: Vec<f64> = angles.iter().copied().filter(|angle| angle.is_finite()).collect();
        Self {
            mean_degrees: sorted.iter().sum::<f64>() / sorted.len().max(1) as f64,
            p95_degrees: percentile(&mut sorted, 0.95),
            max_degrees,
            worst_frame,
            frames_degrees: if keep { angles } else { Vec::new() },
        }
    }
}

fn length_drift(skeleton: &Skeleton, local: &[Transform], driven: &[bool], mapping: &Mapping) -> f64 {
    let pelvis = mapping.pelvis.map(|pelvis| pelvis.target);
    let joints = skeleton.joints().iter().enumerate();
    joints
        .filter(|(index, joint)| driven[*index] && joint.parent.is_some() && Some(*index) != pelvis)
        .map(|(index, joint)| {
            let (rest, now) = (joint.rest.translation.length(), local[index].translation.length());
            if rest > 1e-9 { (now - rest).abs() / rest } else { 0.0 }
        })
        .fold(0.0, f64::max)
}

/// The value below which a share of the values lies; 0 for none.
fn percentile(values: &mut [f64], share: f64) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f64::total_cmp);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length")]
    let index = ((values.len() - 1) as f64 * share).round() as usize;
    values[index.min(values.len() - 1)]
}
