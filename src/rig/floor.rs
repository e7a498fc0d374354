//! Where the floor is under a rig, at rest and in a clip.

use crate::model::{Clip, ModelPose};

use super::understand::Rig;

/// A lowest point closer to the origin than this share of the pelvis height counts as standing on the origin: ankles, balls
/// and toes lie a little above the sole.
const STANDS_ON_ORIGIN: f64 = 0.15;
/// Frames of a clip that are looked at, evenly spread.
const FRAMES_LOOKED_AT: usize = 240;

/// How a rig stands at rest, along its up axis, in the scene's unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stance {
    /// Height of the floor.
    pub(super) floor: f64,
    /// How far the lowest joint of the feet is above the floor; nothing where the rest pose does not stand on the origin, as in
    /// files that have the pelvis there and leave the rest to their clips: the lowest joint itself counts as the floor.
    pub(super) sole: Option<f64>,
    /// The pelvis above the floor, on straight legs.
    pub(super) height: f64,
}

impl Stance {
    /// For a pelvis joint.
    pub(super) fn of(side: &Rig<'_>, pelvis: usize) -> Self {
        let lowest = lowest(side, &side.rest, &supports(side, pelvis));
        let pelvis_height = side.rest_height(pelvis);
        let stands = lowest.abs() <= STANDS_ON_ORIGIN * (pelvis_height - lowest);
        let floor = if stands { lowest.min(0.0) } else { lowest };
        let height = standing_height(side, pelvis, floor).unwrap_or(pelvis_height - floor);
        Self { floor, sole: stands.then_some(lowest - floor), height }
    }
}

/// Height of the floor that the rig stands on at rest, along its up axis, in the scene's unit; nothing where the rest pose does not
/// stand on the file's origin, or no pelvis is known.
#[must_use]
pub fn standing_floor(side: &Rig<'_>) -> Option<f64> {
    let stance = Stance::of(side, *side.role("pelvis").first()?);
    stance.sole.map(|_| stance.floor)
}

/// The pelvis above the floor when thighs and shins are in line below it, as they are in a clip of somebody who stands: rest
/// poses have their legs apart, or their knees bent.
fn standing_height(side: &Rig<'_>, pelvis: usize, floor: f64) -> Option<f64> {
    let leg = |prefix: &str| {
        let joint = |part: &str| side.role(&format!("{prefix}{part}")).first().copied();
        let (thigh, shin, foot) = (joint("thigh")?, joint("shin")?, joint("foot")?);
        let bone = |from: usize, to: usize| {
            let transforms = side.rest.transforms();
            transforms[from].translation.distance(transforms[to].translation)
        };
        let hip = side.rest_height(pelvis) - side.rest_height(thigh);
        Some((hip + bone(thigh, shin) + bone(shin, foot), side.rest_height(foot) - floor))
    };
    match (leg("left_"), leg("right_")) {
        // A rest pose may be a frame of a walk: the lower ankle belongs to the foot that stands.
        (Some(left), Some(right)) => Some((left.0 + right.0) / 2.0 + left.1.min(right.1)),
        (left, right) => left.or(right).map(|(leg, ankle)| leg + ankle),
    }
}

/// Height of the floor in a clip, likewise: what its feet touch.
///
/// For a rig that does not stand at rest; one that does has its floor from there, however high it jumps in a clip. Where the
/// feet come down within a foot's height of the origin or of the rest floor, it is that: clips jump and crouch, and the floor
/// does not.
pub(super) fn clip_floor(side: &Rig<'_>, clip: &Clip, pelvis: usize, rest_floor: f64) -> f64 {
    let supports = supports(side, pelvis);
    let step = clip.frame_count().div_ceil(FRAMES_LOOKED_AT).max(1);
    let mut heights: Vec<f64> = (0..clip.frame_count())
        .step_by(step)
        .map(|frame| {
            let pose = clip.local_pose(side.skeleton(), frame).to_model(side.skeleton());
            lowest(side, &pose, &supports)
        })
        .collect();
    heights.sort_by(f64::total_cmp);
    let floor = heights.get(heights.len() / 20).copied().unwrap_or(rest_floor);
    let height = (side.rest_height(pelvis) - rest_floor).abs();
    let near = |candidate: f64| (floor - candidate).abs() <= STANDS_ON_ORIGIN * height;
    if near(0.0) && near(rest_floor) {
        rest_floor
    } else if near(0.0) {
        0.0
    } else if near(rest_floor) {
        rest_floor
    } else {
        floor
    }
}

/// The joints that can touch the floor: feet and toes with all below them, else everything below the pelvis.
fn supports(side: &Rig<'_>, pelvis: usize) -> Vec<usize> {
    let feet: Vec<usize> = ["left_foot", "right_foot", "left_toe", "right_toe"]
        .iter()
        .flat_map(|role| side.role(role).iter().copied())
        .collect();
    let skeleton = side.skeleton();
    let below = |roots: &[usize]| -> Vec<usize> {
        let is_below = |joint: &usize| roots.iter().any(|root| skeleton.is_ancestor_or_self(*root, *joint));
        (0..skeleton.len()).filter(is_below).collect()
    };
    if feet.is_empty() { below(&[pelvis]) } else { below(&feet) }
}

fn lowest(side: &Rig<'_>, pose: &ModelPose, joints: &[usize]) -> f64 {
    let up = side.up();
    joints.iter().map(|&joint| pose.transforms()[joint].translation.dot(up)).fold(f64::INFINITY, f64::min)
}
