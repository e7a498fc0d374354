//! How deep hands, arms, head, knees and trunk are in the floor, and how far hands are off it where the source's lie on it.
//!
//! By the skin where there is one, else by the joints alone. What the source's part is deep at the same frame is forgiven; of a source without
//! a mesh that is what its joints are, since nobody sees how thick it is.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    body::{Size, bones_length},
    metric::{Finding, Reading, Series},
    motion::{Both, CHUNK_FRAMES, Kinematics, Performer},
    vertex_set::{Row, VertexSet},
};
use crate::{
    model::Transform,
    rig::{Rig, floors, rig_memory::Question},
};

/// The share of a vertex that the joints of a part move if it is one of the part's.
const SHARE_OF_PART: f32 = 0.5;
/// Fewer vertices do not say where a part is.
const FEW_VERTICES: usize = 8;
/// What is farther from the wrist, and than the elbow, is no hand but what it holds, in legs.
const HAND_LEGS: f64 = 0.4;
/// What is as near to the ankle as this, in legs, is no knee.
const SHANK_LEGS: f64 = 0.25;
/// What is lower below the pelvis than this, in legs, is no trunk but a skirt or a cape.
const LAP_LEGS: f64 = 0.3;
/// A hand of the source that is no higher over the floor lies on it, in legs.
const LIES_LEGS: f64 = 0.03;
/// Hands that hang lower as the figure stands, in legs, lie on the floor by no purpose.
const HANGS_LEGS: f64 = 0.15;
/// Hands that are higher are not told how high they are, in legs.
const MAX_HEIGHT_LEGS: f64 = 0.6;
const CENTIMETERS: f64 = 100.0;
const NO_FLOOR: &str = "no floor is known on both sides";
const NO_PARTS: &str = "neither hands, head nor trunk were recognized on both sides";
const NO_HANDS: &str = "no hand of the source lies on the floor in this clip";
const RAISED_GROUND: &str =
    "feet stand above or below the floor, so that nobody knows where it is below the rest of the body";

/// A part of the body.
struct PartOfBody {
    name: &'static str,
    /// The joints that move it.
    roles: &'static [&'static str],
    below: Below,
    /// The joint that is told.
    told: &'static str,
    keep: Keep,
}

/// Which joints below those of a part are part of it.
enum Below {
    None,
    All,
    /// All but those of a role, and what is below them.
    Without(&'static str),
}

/// Which vertices of a part count, by where they are at rest.
enum Keep {
    All,
    /// Those that are no farther from the wrist than a hand is long, or than the elbow is.
    NearWrist([&'static str; 2]),
    /// Those that are not near to a joint.
    FarFrom(&'static str),
    /// Those that are not far below a joint.
    Above(&'static str),
}

const PARTS: [PartOfBody; 8] = [
    part("left_hand", &["left_hand"], Below::All, "left_hand", Keep::NearWrist(["left_hand", "left_forearm"])),
    part("right_hand", &["right_hand"], Below::All, "right_hand", Keep::NearWrist(["right_hand", "right_forearm"])),
    part("left_arm", &["left_upper_arm"], Below::Without("left_hand"), "left_forearm", Keep::All),
    part("right_arm", &["right_upper_arm"], Below::Without("right_hand"), "right_forearm", Keep::All),
    part("left_knee", &["left_thigh"], Below::Without("left_foot"), "left_shin", Keep::FarFrom("left_foot")),
    part("right_knee", &["right_thigh"], Below::Without("right_foot"), "right_shin", Keep::FarFrom("right_foot")),
    part("head", &["head"], Below::None, "head", Keep::All),
    part("trunk", &["pelvis", "spine"], Below::None, "pelvis", Keep::Above("pelvis")),
];

const fn part(
    name: &'static str,
    roles: &'static [&'static str],
    below: Below,
    told: &'static str,
    keep: Keep,
) -> PartOfBody {
    PartOfBody { name, roles, below, told, keep }
}

/// The parts of a rig, whatever it does.
#[derive(Debug)]
struct Parts {
    /// The joints that move them, rising.
    joints: Vec<usize>,
    /// In the order of [`PARTS`]; nothing of what was not recognized.
    parts: Vec<Option<Shape>>,
}

/// Where the surface of a part is.
#[derive(Debug)]
struct Shape {
    /// Empty where the joints alone say it.
    vertices: VertexSet,
    /// Numbers of the joints that move it, and how far what each moves is from it.
    reaches: Vec<(usize, f64)>,
}

/// Of which vertices are the parts of the body? The leg is in meters.
#[derive(PartialEq)]
struct VerticesOfBody {
    leg: f64,
}

impl Question for VerticesOfBody {
    type Answer = Arc<Parts>;
}

/// What is found out about the body and the floor.
pub(super) struct BodyOnFloor {
    /// How much deeper a part is in it than the source's, in centimeters at 1 m leg length; 98th percentile over frames, of the worst part.
    pub(super) penetration: Finding,
    /// How much farther a hand is off it than the source's that lies on it; 95th percentile over those frames.
    pub(super) hand_float: Finding,
}

/// The heights of the lowest points of a part over the floors of both sides, in legs, frame by frame.
struct PartHeights {
    part: &'static PartOfBody,
    joint: usize,
    heights: Both<Vec<f64>>,
}

impl BodyOnFloor {
    pub(super) fn measure(
        performers: &Both<Performer<'_>>,
        sizes: &Both<Size>,
        frames: &[usize],
        has_raised_ground: bool,
    ) -> Self {
        if has_raised_ground {
            return Self { penetration: Err(RAISED_GROUND), hand_float: Err(RAISED_GROUND) };
        }
        let Some(parts) = part_heights(performers, sizes, frames) else {
            return Self { penetration: Err(NO_FLOOR), hand_float: Err(NO_FLOOR) };
        };
        let depth = |(source, target): (f64, f64)| source.min(0.0) - target.min(0.0);
        let sunk: Vec<Series> = parts.iter().map(|part| part.series(depth)).collect();
        let float = |(source, target): (f64, f64)| if source < LIES_LEGS { target - source.max(0.0) } else { f64::NAN };
        let hands = parts
            .iter()
            .filter(|part| part.is_hand() && hangs(&performers.source, sizes.source.leg, part.part) > HANGS_LEGS);
        let off: Vec<Series> = hands.map(|part| part.with_arm(&parts).series(float)).collect();
        Self {
            penetration: Reading::of_worst_part(&sunk, frames, 0.98).ok_or(NO_PARTS),
            hand_float: Reading::of_series(&off, frames, 0.95).ok_or(NO_HANDS),
        }
    }
}

impl PartHeights {
    fn is_hand(&self) -> bool {
        matches!(self.part.keep, Keep::NearWrist(_))
    }

    /// With the height of the target's whole arm: a hand is not off the floor whose forearm lies there.
    fn with_arm(&self, parts: &[Self]) -> Self {
        let arm = self.part.name.replace("_hand", "_arm");
        let mut target = self.heights.target.clone();
        if let Some(arm) = parts.iter().find(|part| part.part.name == arm) {
            target.iter_mut().zip(&arm.heights.target).for_each(|(hand, arm)| *hand = hand.min(*arm));
        }
        Self { heights: Both { source: self.heights.source.clone(), target }, ..*self }
    }

    /// What is more than nothing of a difference of heights, in centimeters.
    fn series(&self, difference: impl Fn((f64, f64)) -> f64) -> Series {
        let pairs = self.heights.source.iter().copied().zip(self.heights.target.iter().copied());
        // What is not a number stays so.
        let values =
            pairs.map(|pair| difference(pair) * CENTIMETERS).map(|value| if value < 0.0 { 0.0 } else { value });
        Series { part: self.part.name.to_owned(), joint: self.joint, values: values.collect() }
    }
}

/// Nothing where a floor or a leg is not known.
fn part_heights(performers: &Both<Performer<'_>>, sizes: &Both<Size>, frames: &[usize]) -> Option<Vec<PartHeights>> {
    let heights = |performer: &Performer<'_>, size: &Size| {
        let (leg, (_, floor)) = (size.leg?, floors(performer.rig, performer.clip)?);
        let parts = performer.rig.recall(VerticesOfBody { leg }, |_| Arc::new(Parts::find(performer.rig, leg)));
        Some(parts.heights(performer, frames, floor, leg))
    };
    let source = heights(&performers.source, &sizes.source)?;
    let target = heights(&performers.target, &sizes.target)?;
    let both = PARTS.iter().zip(source.into_iter().zip(target)).filter_map(|(part, (source, target))| {
        let joint = performers.target.rig.role(part.told).first().copied()?;
        Some(PartHeights { part, joint, heights: Both { source: source?, target: target? } })
    });
    Some(both.collect())
}

/// How high a hand is over the floor where the rig stands and its arm hangs straight down, in legs.
fn hangs(performer: &Performer<'_>, leg: Option<f64>, hand: &PartOfBody) -> f64 {
    let Keep::NearWrist([wrist, elbow]) = hand.keep else { return f64::INFINITY };
    let (rig, shoulder) = (performer.rig, elbow.replace("_forearm", "_upper_arm"));
    let [shoulder, elbow, wrist] = [&shoulder, elbow, wrist].map(|role| rig.role(role).first().copied());
    let (Some(shoulder), Some(elbow), Some(wrist)) = (shoulder, elbow, wrist) else { return f64::INFINITY };
    let (Some(leg), Some((floor, _))) = (leg, floors(rig, performer.clip)) else { return f64::INFINITY };
    let arm = bones_length(rig, shoulder, elbow) + bones_length(rig, elbow, wrist);
    ((rig.rest_height(shoulder) - floor) * rig.unit_meters - arm) / leg - HAND_LEGS / 2.0
}

impl Parts {
    fn find(rig: &Rig<'_>, leg: f64) -> Self {
        let skin = &rig.scene.skin_vertices;
        let chosen: Vec<Option<(Vec<usize>, Vec<usize>)>> = PARTS.iter().map(|part| part.choose(rig, leg)).collect();
        let influences = |vertex: &usize| skin.of(*vertex).iter().map(|one| one.joint as usize);
        let moving = chosen.iter().flatten().flat_map(|(joints, vertices)| {
            let alone: &[usize] = if vertices.is_empty() { joints } else { &[] };
            vertices.iter().flat_map(influences).chain(alone.iter().copied())
        });
        let joints = rig.skeleton().with_ancestors(moving);
        let number = |joint: &usize| joints.binary_search(joint).unwrap_or(0);
        let shape = |(own, vertices): &(Vec<usize>, Vec<usize>)| {
            let vertices = VertexSet::of_skin(rig, vertices, &joints, leg);
            let bare = || own.iter().map(|joint| (number(joint), 0.0)).collect();
            let reaches = if vertices.is_empty() { bare() } else { vertices.reaches() };
            Shape { vertices, reaches }
        };
        let parts = chosen.iter().map(|chosen| chosen.as_ref().map(shape)).collect();
        Self { joints, parts }
    }

    /// How high the lowest point of each part is over a floor, in legs, frame by frame; of hands and arms alone what is above it. Nothing for parts
    /// that are not known. The leg is in meters.
    fn heights(&self, performer: &Performer<'_>, frames: &[usize], floor: f64, leg: f64) -> Vec<Option<Vec<f64>>> {
        let kinematics = Kinematics::of_joints(performer, &self.joints);
        let (unit, up) = (leg / performer.rig.unit_meters, performer.rig.up());
        let limit = |part: &PartOfBody| {
            let is_of_arm = part.name.ends_with("_hand") || part.name.ends_with("_arm");
            let most = if is_of_arm { MAX_HEIGHT_LEGS } else { 0.0 };
            floor + most * unit
        };
        let of_chunk = |frames: &[usize]| {
            let mut model = vec![Transform::IDENTITY; kinematics.len()];
            let mut rows = vec![Row::default(); kinematics.len()];
            let mut first = vec![0; self.parts.len()];
            let mut heights = Vec::with_capacity(frames.len() * self.parts.len());
            for &frame in frames {
                kinematics.pose(frame, &mut model);
                rows.iter_mut().zip(&model).for_each(|(row, joint)| *row = Row::of(joint, up));
                for ((part, shape), first) in PARTS.iter().zip(&self.parts).zip(&mut first) {
                    let lowest = shape.as_ref().map_or(floor, |shape| shape.lowest(limit(part), &rows, first));
                    heights.push((lowest - floor) / unit);
                }
            }
            heights
        };
        let chunks: Vec<Vec<f64>> = frames.par_chunks(CHUNK_FRAMES).map(of_chunk).collect();
        let width = self.parts.len();
        let of_part = |(index, part): (usize, &Option<Shape>)| {
            part.as_ref()?;
            Some(chunks.iter().flat_map(|chunk| chunk.iter().skip(index).step_by(width).copied()).collect())
        };
        self.parts.iter().enumerate().map(of_part).collect()
    }
}

impl Shape {
    /// Its lowest height, or a limit where it is higher. `first` is where it was lowest in the frame before.
    fn lowest(&self, limit: f64, rows: &[Row], first: &mut usize) -> f64 {
        let bound = |&(joint, reach): &(usize, f64)| rows[joint].lower_bound(reach);
        let bound = self.reaches.iter().map(bound).fold(f64::INFINITY, f64::min);
        if bound >= limit || self.vertices.is_empty() {
            return bound.min(limit);
        }
        let lowest;
        (lowest, *first) = self.vertices.lowest_below(limit, rows, *first);
        lowest
    }
}

impl PartOfBody {
    /// Its joints and vertices; no vertices where there are few, and nothing where it was not recognized.
    fn choose(&self, rig: &Rig<'_>, leg: f64) -> Option<(Vec<usize>, Vec<usize>)> {
        let skeleton = rig.skeleton();
        let own: Vec<usize> = self.roles.iter().flat_map(|role| rig.role(role)).copied().collect();
        let first = |role: &str| rig.role(role).first().copied();
        let is_part = |joint: usize| match self.below {
            Below::None => false,
            Below::All => true,
            Below::Without(role) => first(role) != Some(joint),
        };
        let mut is_own = vec![false; skeleton.len()];
        for joint in 0..skeleton.len() {
            let is_below = skeleton.parent(joint).is_some_and(|parent| is_own[parent]);
            is_own[joint] = own.contains(&joint) || (is_below && is_part(joint));
        }
        let place = |joint: usize| rig.rest.transforms()[joint].translation * rig.unit_meters;
        let at = |role: &str| first(role).map(place);
        let is_kept = |vertex: DVec3| match self.keep {
            Keep::All => true,
            Keep::NearWrist([wrist, elbow]) => at(wrist).is_some_and(|wrist| {
                let most = at(elbow).map_or(0.0, |elbow| elbow.distance(wrist)).max(HAND_LEGS * leg);
                vertex.distance(wrist) < most
            }),
            Keep::FarFrom(joint) => at(joint).is_none_or(|joint| vertex.distance(joint) > SHANK_LEGS * leg),
            Keep::Above(joint) => at(joint).is_none_or(|joint| (vertex - joint).dot(rig.up()) > -LAP_LEGS * leg),
        };
        let joints: Vec<usize> = (0..skeleton.len()).filter(|joint| is_own[*joint] && is_kept(place(*joint))).collect();
        if own.is_empty() || joints.is_empty() {
            return None;
        }
        let skin = &rig.scene.skin_vertices;
        let is_of_part = |vertex: &usize| {
            let own = skin.of(*vertex).iter().filter(|one| is_own[one.joint as usize]);
            own.map(|one| one.weight).sum::<f32>() >= SHARE_OF_PART
                && is_kept(skin.place(*vertex, &rig.rest) * rig.unit_meters)
        };
        let vertices: Vec<usize> = (0..skin.len()).filter(is_of_part).collect();
        Some((joints, if vertices.len() < FEW_VERTICES { Vec::new() } else { vertices }))
    }
}
