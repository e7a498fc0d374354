//! Where the floor is under a rig, at rest and in a clip.

use crate::model::{Clip, ModelPose};

use super::{rig::Rig, rig_memory::Question};

/// A lowest point closer to the origin than this share of the pelvis height counts as standing on the origin: ankles, balls
/// and toes lie a little above the sole.
const STANDS_ON_ORIGIN: f64 = 0.15;
/// A sole of the mesh closer to the origin than this share of the pelvis height is meant to stand on it.
const SOLE_ON_ORIGIN: f64 = 0.05;
/// The sole of a mesh is at most this share of the pelvis height below the lowest joint of the feet; one that is further away
/// does not belong to the skeleton as it stands.
const THICKEST_SOLE: f64 = 0.25;
/// A lowest joint higher above the origin than this share of the pelvis height is no ankle that stands there, but hovers.
const THICK: f64 = 0.1;
/// Feet that stand come at most this share of the pelvis height below the floor of a clip.
const SINKS: f64 = 0.03;
/// Fewer points are no foot.
const FEW_POINTS: usize = 8;
/// Frames of a clip that are looked at, evenly spread.
const FRAMES_LOOKED_AT: usize = 240;

/// How a rig stands at rest, along its up axis, in the scene's unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stance {
    /// Height of the floor.
    pub(crate) floor: f64,
    /// How far the lowest joint of the feet is above the floor; nothing where neither a mesh says it nor the rest pose stands on
    /// the origin, as in files that have the pelvis there and leave the rest to their clips: the lowest joint itself counts as
    /// the floor.
    pub(crate) sole: Option<f64>,
    /// Whether the rest pose stands on the file's own floor, so that the floor of its clips is known too.
    pub(crate) stands: bool,
    /// The pelvis above the floor, on straight legs.
    pub(crate) height: f64,
    /// The pelvis above the ankles, on straight legs; nothing where a leg has no three joints.
    pub(crate) legs: Option<f64>,
}

/// How does it stand?
#[derive(PartialEq)]
struct HowItStands {
    pelvis: usize,
}

impl Question for HowItStands {
    type Answer = Stance;
}

impl Stance {
    /// For a pelvis joint.
    pub(crate) fn of(side: &Rig<'_>, pelvis: usize) -> Self {
        side.recall(HowItStands { pelvis }, |_| Self::find(side, pelvis))
    }

    fn find(side: &Rig<'_>, pelvis: usize) -> Self {
        let supports = supports(side, pelvis);
        let lowest = lowest(side, &side.rest, &supports);
        let pelvis_height = side.rest_height(pelvis);
        let stands = lowest.abs() <= STANDS_ON_ORIGIN * (pelvis_height - lowest);
        let mesh = mesh_sole(side, &side.rest, &supports, pelvis_height);
        let bottom = mesh.unwrap_or(if stands { lowest.min(0.0) } else { lowest });
        // Soles are on the floor of the file, but for what the modeler left between them.
        let is_meant = stands && mesh.is_some_and(|sole| sole.abs() <= SOLE_ON_ORIGIN * (pelvis_height - lowest));
        let floor = if is_meant { 0.0 } else { bottom };
        let (legs, ankle) = standing_legs(side, pelvis, bottom).unzip();
        let height = legs.zip(ankle).map_or(pelvis_height - bottom, |(legs, ankle)| legs + ankle);
        Self { floor, sole: (stands || mesh.is_some()).then_some(lowest - bottom), height, stands, legs }
    }
}

/// Height of the lowest point of a rig's feet in a pose: of their mesh where there is one, else of their joints. Nothing where
/// nothing is below the pelvis.
pub(crate) fn lowest_sole(side: &Rig<'_>, pose: &ModelPose, pelvis: usize) -> Option<f64> {
    lowest_of(side, pose, pelvis, &supports(side, pelvis))
}

/// The same of one pair of an animal's paws: `front_leg` or `hind_leg`. Nothing where there is no such pair.
pub(crate) fn lowest_paw(side: &Rig<'_>, pose: &ModelPose, pelvis: usize, pair: &str) -> Option<f64> {
    lowest_of(side, pose, pelvis, &below(side, &paws(side, &[pair])))
}

fn lowest_of(side: &Rig<'_>, pose: &ModelPose, pelvis: usize, joints: &[usize]) -> Option<f64> {
    let height = pose.transforms()[pelvis].translation.dot(side.up());
    let sole = mesh_sole(side, pose, joints, height).unwrap_or_else(|| lowest(side, pose, joints));
    sole.is_finite().then_some(sole)
}

/// Height of the lowest vertex of the feet in a pose, where the mesh lies about the joints as it should.
fn mesh_sole(side: &Rig<'_>, pose: &ModelPose, joints: &[usize], pelvis_height: f64) -> Option<f64> {
    let up = side.up();
    let (mut count, mut sole) = (0, f64::INFINITY);
    for &joint in joints {
        let transform = &pose.transforms()[joint];
        for point in side.scene.skin_points.of(joint) {
            sole = sole.min(transform.transform_point(point.position.as_dvec3()).dot(up));
            count += 1;
        }
    }
    let lowest = lowest(side, pose, joints);
    let thickness = lowest - sole;
    let most = THICKEST_SOLE * (pelvis_height - lowest);
    (count >= FEW_POINTS && (-0.2 * most..most).contains(&thickness)).then_some(sole)
}

/// Height of the floor that the rig stands on at rest, along its up axis, in the scene's unit; nothing where the rest pose does not
/// stand on the file's origin, or no pelvis is known.
#[must_use]
pub fn standing_floor(side: &Rig<'_>) -> Option<f64> {
    let stance = Stance::of(side, *side.role("pelvis").first()?);
    stance.stands.then_some(stance.floor)
}

/// Height of the floor under a rig at rest, and in a clip of it, along its up axis, in the scene's unit. The two differ where the rest
/// pose of a file stands elsewhere than its clips do, as in those that have the pelvis at the origin. Nothing where no pelvis is
/// known.
#[must_use]
pub fn floors(side: &Rig<'_>, clip: &Clip) -> Option<(f64, f64)> {
    let pelvis = *side.role("pelvis").first()?;
    let stance = Stance::of(side, pelvis);
    let in_clip = if stance.stands { stance.floor } else { clip_floor(side, clip, pelvis, stance.floor).height };
    Some((stance.floor, in_clip))
}

/// The pelvis above the ankles when thighs and shins are in line below it, as they are in a clip of somebody who stands: rest
/// poses have their legs apart, or their knees bent. And the ankles above the floor.
fn standing_legs(side: &Rig<'_>, pelvis: usize, floor: f64) -> Option<(f64, f64)> {
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
        (Some(left), Some(right)) => Some((f64::midpoint(left.0, right.0), left.1.min(right.1))),
        (left, right) => left.or(right),
    }
}

/// Where the floor is in a clip, in the scene's unit along the rig's up axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClipFloor {
    /// Height of the floor.
    pub(crate) height: f64,
    /// Whether only that joint says where the floor is, so that the floor is as far below as the sole is thick.
    pub(crate) is_joint: bool,
}

/// The floor of a clip: what its feet touch.
///
/// For a rig that does not stand at rest; one that does has its floor from there, however high it jumps in a clip. Where the
/// feet come down within a foot's height above the origin or the rest floor, it is that: clips jump and crouch, and the floor
/// does not. It is never above them.
pub(crate) fn clip_floor(side: &Rig<'_>, clip: &Clip, pelvis: usize, rest_floor: f64) -> ClipFloor {
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
    let touching = heights.get(heights.len() / 20).copied().unwrap_or(rest_floor);
    let height = (side.rest_height(pelvis) - rest_floor).abs();
    let above = |candidate: f64| (-SINKS * height..=STANDS_ON_ORIGIN * height).contains(&(touching - candidate));
    if above(rest_floor) {
        ClipFloor { height: rest_floor, is_joint: true }
    } else if above(0.0) && touching <= THICK * height {
        ClipFloor { height: 0.0, is_joint: false }
    } else {
        ClipFloor { height: touching, is_joint: true }
    }
}

/// The joints that can touch the floor: feet, toes and paws with all below them, else everything below the pelvis.
fn supports(side: &Rig<'_>, pelvis: usize) -> Vec<usize> {
    let mut feet = paws(side, &["front_leg", "hind_leg"]);
    let roles = ["left_foot", "right_foot", "left_toe", "right_toe"];
    feet.extend(roles.iter().flat_map(|role| side.role(role).iter().copied()));
    if feet.is_empty() { below(side, &[pelvis]) } else { below(side, &feet) }
}

/// The last joints of an animal's legs.
fn paws(side: &Rig<'_>, pairs: &[&str]) -> Vec<usize> {
    let legs = pairs.iter().flat_map(|pair| ["left", "right"].map(|left_or_right| format!("{left_or_right}_{pair}")));
    legs.filter_map(|leg| side.role(&leg).last().copied()).collect()
}

fn below(side: &Rig<'_>, roots: &[usize]) -> Vec<usize> {
    let skeleton = side.skeleton();
    let is_below = |joint: &usize| roots.iter().any(|root| skeleton.is_ancestor_or_self(*root, *joint));
    (0..skeleton.len()).filter(is_below).collect()
}

fn lowest(side: &Rig<'_>, pose: &ModelPose, joints: &[usize]) -> f64 {
    let up = side.up();
    joints.iter().map(|&joint| pose.transforms()[joint].translation.dot(up)).fold(f64::INFINITY, f64::min)
}
