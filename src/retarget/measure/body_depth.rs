//! How deep hands, arms, head, knees and trunk are in the floor.
//!
//! By the skin where there is one, else by the joints alone. What the source's part is deep at the same frame is forgiven; of a source without
//! a mesh that is what its joints are, since nobody sees how thick it is.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    body::Size,
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
const CENTIMETERS: f64 = 100.0;
const NO_FLOOR: &str = "no floor is known on both sides";
const NO_PARTS: &str = "neither hands, head nor trunk were recognized on both sides";
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

/// How much deeper a part is in the floor than the source's, in centimeters at 1 m leg length; 98th percentile over frames, of the worst part.
pub(super) fn body_depth(
    performers: &Both<Performer<'_>>,
    sizes: &Both<Size>,
    frames: &[usize],
    has_raised_ground: bool,
) -> Finding {
    if has_raised_ground {
        return Err(RAISED_GROUND);
    }
    let legs = sizes.map(|size| size.leg);
    let (Some(source_leg), Some(target_leg)) = (legs.source, legs.target) else { return Err(NO_FLOOR) };
    let depths = |performer: &Performer<'_>, leg: f64| {
        let (_, floor) = floors(performer.rig, performer.clip)?;
        let parts = performer.rig.recall(VerticesOfBody { leg }, |_| Arc::new(Parts::find(performer.rig, leg)));
        Some(parts.depths(performer, frames, floor))
    };
    let (source, target) = (
        depths(&performers.source, source_leg).ok_or(NO_FLOOR)?,
        depths(&performers.target, target_leg).ok_or(NO_FLOOR)?,
    );
    let beyond = |(source, target): (&f64, &f64)| (target / target_leg - source / source_leg).max(0.0) * CENTIMETERS;
    let series = PARTS.iter().zip(source.iter().zip(&target)).filter_map(|(part, (source, target))| {
        let values = source.as_ref()?.iter().zip(target.as_ref()?).map(beyond).collect();
        let joint = performers.target.rig.role(part.told).first().copied()?;
        Some(Series { part: part.name.to_owned(), joint, values })
    });
    Reading::of_worst_part(&series.collect::<Vec<Series>>(), frames, 0.98).ok_or(NO_PARTS)
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

    /// How deep each part is below a floor, in meters, frame by frame; nothing for parts that are not known.
    fn depths(&self, performer: &Performer<'_>, frames: &[usize], floor: f64) -> Vec<Option<Vec<f64>>> {
        let kinematics = Kinematics::of_joints(performer, &self.joints);
        let (unit, up) = (performer.rig.unit_meters, performer.rig.up());
        let of_chunk = |frames: &[usize]| {
            let mut model = vec![Transform::IDENTITY; kinematics.len()];
            let mut rows = vec![Row::default(); kinematics.len()];
            let mut first = vec![0; self.parts.len()];
            let mut depths = Vec::with_capacity(frames.len() * self.parts.len());
            for &frame in frames {
                kinematics.pose(frame, &mut model);
                rows.iter_mut().zip(&model).for_each(|(row, joint)| *row = Row::of(joint, up));
                for (part, first) in self.parts.iter().zip(&mut first) {
                    let depth = part.as_ref().map_or(0.0, |part| part.depth(floor, &rows, first));
                    depths.push(depth * unit);
                }
            }
            depths
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
    /// `first` is where it was lowest in the frame before.
    fn depth(&self, floor: f64, rows: &[Row], first: &mut usize) -> f64 {
        let bound = |&(joint, reach): &(usize, f64)| rows[joint].lower_bound(reach);
        let bound = self.reaches.iter().map(bound).fold(f64::INFINITY, f64::min);
        if bound >= floor {
            return 0.0;
        }
        if self.vertices.is_empty() {
            return floor - bound;
        }
        let lowest;
        (lowest, *first) = self.vertices.lowest_below(floor, rows, *first);
        floor - lowest
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
