//! How a foot is turned in a rest pose that is a moment of a motion.
//!
//! Where ankle and toe joints lie in a foot differs by tens of degrees from one body to another, so the line between them does not
//! tell how the sole is turned; and in a foot that swings it may point straight down, so that it does not tell where the foot heads.
//! What does is how the same foot is turned where it lies flat, which is where its ankle and toes are lowest.

use glam::{DQuat, DVec3};

use super::{super::rig::Rig, look::Look, split};
use crate::model::ModelPose;

/// Frames of a clip that are looked at, evenly spread.
const FRAMES_LOOKED_AT: usize = 120;
/// One in so many of the lowest feet lies flat.
const ONE_IN_LOWEST: usize = 10;
/// Feet are flat to this many degrees.
const FLAT_DEGREES: f64 = 5.0;

/// Legs whose bones are no more than this steeper or flatter stand in the same step.
const SAME_STEP_DEGREES: f64 = 5.0;

/// A foot that does not lie flat at rest, in canonical space.
#[derive(Clone, Copy, Debug)]
pub(super) struct RaisedFoot {
    /// From how it is turned where it lies flat to how it is turned at rest.
    pub(super) rest_from_flat: DQuat,
    /// From ankle to toes where it lies flat.
    pub(super) along: DVec3,
}

/// One foot at one moment, in canonical space.
struct Foot {
    /// Of ankle and toe joint together.
    height: f64,
    /// From ankle to toes; unit length.
    along: DVec3,
    turned: DQuat,
}

impl Look<'_> {
    /// Whether the legs of both rest poses are posed alike, feet and all: then feet are raised on both sides or on neither, whatever is
    /// known of either. Where a body in a step faces is guessed, so only how steep bones are is compared.
    pub(super) fn stands_in_the_step_of(&self, other: &Self) -> bool {
        let bones = [("thigh", "shin"), ("shin", "foot"), ("foot", "toe")];
        let sides = ["left_", "right_"];
        sides.iter().flat_map(|side| bones.map(|(from, to)| (format!("{side}{from}"), format!("{side}{to}")))).all(
            |(from, to)| {
                let both = self.toward(&from, &to).zip(other.toward(&from, &to));
                both.is_some_and(|(own, other)| (own.y.asin() - other.y.asin()).abs().to_degrees() < SAME_STEP_DEGREES)
            },
        )
    }

    /// How a foot is raised; nothing where it lies flat, as in poses that somebody laid out.
    pub(super) fn raised_foot(&self, role: &str) -> Option<RaisedFoot> {
        match self {
            Self::Rig(rig) if rig.rest_source.is_in_motion() => raised(rig, role),
            Self::Rig(_) | Self::Canonical(_) => None,
        }
    }
}

fn raised(rig: &Rig<'_>, role: &str) -> Option<RaisedFoot> {
    let (side, _) = split(role);
    let rest = foot(rig, &rig.rest, side)?;
    let flat = flat(rig, side)?;
    let rest_from_flat = rest.turned * flat.turned.conjugate();
    // Turning about the vertical raises nothing.
    let raised = (rest_from_flat * DVec3::Y).angle_between(DVec3::Y);
    (raised.to_degrees() >= FLAT_DEGREES).then_some(RaisedFoot { rest_from_flat, along: flat.along })
}

/// A foot where it is lowest, at rest and in the first clip that moves: the one whose pitch is in the middle.
fn flat(rig: &Rig<'_>, side: &str) -> Option<Foot> {
    let mut feet: Vec<Foot> = foot(rig, &rig.rest, side).into_iter().collect();
    if let Some(clip) = rig.scene.clips.iter().find(|clip| clip.is_animated()) {
        let step = clip.frame_count().div_ceil(FRAMES_LOOKED_AT).max(1);
        for frame in (0..clip.frame_count()).step_by(step) {
            feet.extend(foot(rig, &clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton()), side));
        }
    }
    feet.sort_by(|one, other| one.height.total_cmp(&other.height));
    feet.truncate(feet.len().div_ceil(ONE_IN_LOWEST));
    feet.sort_by(|one, other| one.along.y.total_cmp(&other.along.y));
    let middle = feet.len() / 2;
    feet.into_iter().nth(middle)
}

fn foot(rig: &Rig<'_>, pose: &ModelPose, side: &str) -> Option<Foot> {
    let joint = |part: &str| Some(pose.transforms()[*rig.role(&format!("{side}{part}")).first()?]);
    let (ankle, toe) = (joint("foot")?, joint("toe")?);
    let place = |place: DVec3| rig.canonical_from_scene * place;
    let along = (place(toe.translation) - place(ankle.translation)).try_normalize()?;
    let height = place(toe.translation).y + place(ankle.translation).y;
    Some(Foot { height, along, turned: (rig.canonical_from_scene * ankle.rotation).normalize() })
}
