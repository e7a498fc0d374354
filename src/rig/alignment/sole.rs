//! How far a foot is tilted in a rest pose that is a moment of a motion.
//!
//! Where ankle and toe joints lie in a foot differs by tens of degrees from one body to another, so the line between them does not
//! tell how the sole is tilted. What does is its pitch against that of the same body's feet when they lie flat, which is how they
//! are where ankle and toes are lowest.

use glam::DVec3;

use super::{super::understand::Rig, look::Look, split};
use crate::model::ModelPose;

/// Frames of a clip that are looked at, evenly spread.
const FRAMES_LOOKED_AT: usize = 120;
/// One in so many of the lowest feet lies flat.
const ONE_IN_LOWEST: usize = 10;
/// Feet are flat to this many degrees.
const FLAT_DEGREES: f64 = 5.0;

/// One foot at one moment, in working space.
struct Foot {
    /// Of ankle and toe joint together.
    height: f64,
    /// Of the line from ankle to toe against the horizontal; upward is more.
    pitch_radians: f64,
}

impl Look<'_> {
    /// How far the toes of a foot are raised against a flat sole, in radians; 0 for poses that somebody laid out, which stand flat.
    pub(super) fn foot_tilt_radians(&self, role: &str) -> f64 {
        match self {
            Self::Rig(rig) if rig.rest_source.is_in_motion() => tilt(rig, role).unwrap_or(0.0),
            Self::Rig(_) | Self::Canonical(_) => 0.0,
        }
    }
}

fn tilt(rig: &Rig<'_>, role: &str) -> Option<f64> {
    let (side, _) = split(role);
    let tilt = foot(rig, &rig.rest, side)?.pitch_radians - flat_pitch(rig)?;
    Some(if tilt.to_degrees().abs() < FLAT_DEGREES { 0.0 } else { tilt })
}

/// The pitch of the feet where they are lowest, at rest and in the first clip that moves.
fn flat_pitch(rig: &Rig<'_>) -> Option<f64> {
    let mut feet = both_feet(rig, &rig.rest);
    if let Some(clip) = rig.scene.clips.iter().find(|clip| clip.is_animated()) {
        let step = clip.frame_count().div_ceil(FRAMES_LOOKED_AT).max(1);
        for frame in (0..clip.frame_count()).step_by(step) {
            feet.extend(both_feet(rig, &clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton())));
        }
    }
    feet.sort_by(|one, other| one.height.total_cmp(&other.height));
    feet.truncate(feet.len().div_ceil(ONE_IN_LOWEST));
    feet.sort_by(|one, other| one.pitch_radians.total_cmp(&other.pitch_radians));
    feet.get(feet.len() / 2).map(|foot| foot.pitch_radians)
}

fn both_feet(rig: &Rig<'_>, pose: &ModelPose) -> Vec<Foot> {
    ["left_", "right_"].iter().filter_map(|side| foot(rig, pose, side)).collect()
}

fn foot(rig: &Rig<'_>, pose: &ModelPose, side: &str) -> Option<Foot> {
    let place = |part: &str| -> Option<DVec3> {
        let joint = *rig.role(&format!("{side}{part}")).first()?;
        Some(rig.work_from_scene * pose.transforms()[joint].translation)
    };
    let (ankle, toe) = (place("foot")?, place("toe")?);
    let along = (toe - ankle).try_normalize()?;
    Some(Foot { height: ankle.y + toe.y, pitch_radians: along.y.clamp(-1.0, 1.0).asin() })
}
