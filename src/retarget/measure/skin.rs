//! The vertices of the feet, skinned in every frame: how low each part of a foot is, and how it moves over the floor.
//!
//! Linear blend skinning with all influences. A foot's vertices are those that its joints move by at least half. The lowest of them
//! is found exactly, without skinning all: vertices that lie together make clusters, and a cluster that cannot reach below what was
//! found is passed over. Everything comes out in meters.

use std::{ops::Range, sync::Arc};

use glam::{DQuat, DVec2, DVec3, swizzles::Vec3Swizzles};
use rayon::prelude::*;

use super::motion::{CHUNK_FRAMES, Kinematics, Performer};
use crate::{
    model::{Influence, SkinVertices, Transform},
    rig::{Rig, rig_memory::Question},
};

/// The share of a vertex that the joints of a foot move if it is one of the foot's.
const SHARE_OF_FOOT: f32 = 0.5;
/// Fewer vertices are no foot.
const FEW_VERTICES: usize = 8;
/// Vertices this much above the lowest one at rest can touch the floor, in leg lengths, and how many of them are followed.
const SOLE: f64 = 0.03;
const MAX_FOLLOWED: usize = 24;
/// Followed vertices this close to the lowest one touch the floor, in leg lengths.
const TOUCH: f64 = 0.005;
/// Vertices of a cluster, at most, and the size of the cells in which vertices lie together, in leg lengths.
const CLUSTER: usize = 24;
const CELL: f64 = 0.025;

/// A part of a foot that stands by itself: heel, ball, or a paw as a whole.
#[derive(Debug, Default)]
struct Part {
    /// All vertices.
    clusters: Vec<Cluster>,
    shares: Vec<Share>,
    /// Where the shares of each vertex end.
    ends: Vec<usize>,
    /// Vertices of the sole, whose way over the floor is followed.
    sole: Vec<Vec<Share>>,
}

/// One joint's share of a vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Share {
    /// The joint's number in [`Kinematics`].
    joint: usize,
    weight: f64,
    /// Its position in the joint's space, times the weight.
    place: DVec3,
}

/// Vertices that lie together and move with the same joints, and how far from their middle they can be.
#[derive(Debug, Default)]
struct Cluster {
    vertices: Range<usize>,
    /// The mean vertex.
    middle: Vec<Share>,
    /// How far a vertex is from it, in the joints' spaces.
    radius: f64,
    /// How much a joint's weight differs from its mean, for each share of the middle.
    spread: Vec<f64>,
}

/// What a joint's pose means for heights: `height = row · place + height · weight`.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    row: DVec3,
    length: f64,
    height: f64,
}

/// What is looked at on one rig.
pub(super) struct FootSkin<'a> {
    performer: Performer<'a>,
    kinematics: Kinematics<'a>,
    parts: Arc<FootParts>,
    leg: f64,
}

/// The parts of the feet of a rig, whatever it does.
#[derive(Debug)]
struct FootParts {
    /// The joints that move them.
    joints: Vec<usize>,
    parts: Vec<Part>,
}

/// Of which vertices are these parts of the feet? The leg is in meters.
#[derive(PartialEq)]
struct VerticesOfFeet {
    wanted: Vec<WantedPart>,
    leg: f64,
}

impl Question for VerticesOfFeet {
    /// Nothing where a foot has no vertices.
    type Answer = Option<Arc<FootParts>>;
}

/// One part of a foot over the clip.
#[derive(Debug, Default)]
pub(super) struct PartTrack {
    /// Height of the lowest vertex per frame, meters; empty where the part has no vertices.
    pub(super) heights: Vec<f32>,
    /// How far what touches the floor moves over it until the next frame, meters; nothing where nobody wants to know.
    pub(super) steps: Vec<Option<DVec2>>,
}

/// A part to look for: the joints whose vertices count, and where a foot is divided.
#[derive(PartialEq)]
pub(super) struct WantedPart {
    /// The joints of the foot: with all that is below them.
    pub(super) joints: Vec<usize>,
    /// The part of the foot on one side of the ball; all of the foot where nothing.
    pub(super) half: Option<Half>,
}

/// One side of the ball of a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Half {
    /// Whether it is the toes' side.
    pub(super) is_front: bool,
    /// Of the ankle and the ball.
    pub(super) ankle: usize,
    /// Likewise.
    pub(super) ball: usize,
}

impl<'a> FootSkin<'a> {
    /// Nothing where a foot has no vertices, so that both feet are measured alike. `leg` is the leg in meters.
    pub(super) fn find(performer: Performer<'a>, wanted: Vec<WantedPart>, leg: f64) -> Option<Self> {
        let rig = performer.rig;
        let find = |asked: &VerticesOfFeet| FootParts::find(rig, &asked.wanted, leg).map(Arc::new);
        let parts = rig.recall(VerticesOfFeet { wanted, leg }, find)?;
        Some(Self { performer, kinematics: Kinematics::of_joints(&performer, &parts.joints), parts, leg })
    }

    /// Follows every part over frames that are neighbors. `moves` says of each part in which frames its steps are wanted, by their places in
    /// `frames`.
    pub(super) fn follow(&self, frames: &[usize], moves: &[&[bool]]) -> Vec<PartTrack> {
        let chunks: Vec<Vec<PartTrack>> = frames
            .par_chunks(CHUNK_FRAMES)
            .enumerate()
            .map(|(chunk, own)| {
                let begin = chunk * CHUNK_FRAMES;
                let moves: Vec<&[bool]> = moves.iter().map(|part| part.get(begin..).unwrap_or_default()).collect();
                self.follow_chunk(own, frames.get(begin + CHUNK_FRAMES).copied(), &moves)
            })
            .collect();
        let mut tracks: Vec<PartTrack> = self.parts.parts.iter().map(|_| PartTrack::default()).collect();
        for (track, part) in
            chunks.into_iter().flat_map(|chunk| chunk.into_iter().enumerate().map(|(part, track)| (track, part)))
        {
            tracks[part].heights.extend(track.heights);
            tracks[part].steps.extend(track.steps);
        }
        tracks
    }

    /// `next` is the frame after the chunk, which its last step leads to.
    fn follow_chunk(&self, frames: &[usize], next: Option<usize>, moves: &[&[bool]]) -> Vec<PartTrack> {
        let rig = self.performer.rig;
        let (unit, up) = (rig.unit_meters, rig.up());
        let mut model = vec![Transform::IDENTITY; self.kinematics.len()];
        let mut rows = vec![Row::default(); self.kinematics.len()];
        let mut parts: Vec<FollowedPart<'_>> =
            self.parts.parts.iter().zip(moves).map(|(part, moves)| FollowedPart::new(part, moves)).collect();
        for (index, frame) in frames.iter().copied().chain(next).enumerate() {
            self.kinematics.pose(frame, &mut model);
            for (row, joint) in rows.iter_mut().zip(&model) {
                let along = joint.rotation.conjugate() * up * joint.scale;
                *row = Row { row: along, length: along.length(), height: joint.translation.dot(up) };
            }
            for followed in &mut parts {
                if index < frames.len() && !followed.part.clusters.is_empty() {
                    let height = followed.lowest(&rows) * unit;
                    #[expect(clippy::cast_possible_truncation, reason = "meters")]
                    followed.track.heights.push(height as f32);
                }
                followed.step(index, (rig.canonical_from_scene, unit, &model), TOUCH * self.leg);
            }
        }
        parts.into_iter().map(|followed| followed.track).collect()
    }
}

/// A part of a foot on its way through the frames.
struct FollowedPart<'a> {
    part: &'a Part,
    /// The frames whose steps are wanted.
    moves: &'a [bool],
    /// The cluster that was lowest in the frame before.
    lowest: usize,
    /// Where the vertices of the sole are in the frame before and in this one, meters, +Y up.
    before: Vec<DVec3>,
    now: Vec<DVec3>,
    track: PartTrack,
}

impl<'a> FollowedPart<'a> {
    fn new(part: &'a Part, moves: &'a [bool]) -> Self {
        let (before, now) = (Vec::with_capacity(part.sole.len()), Vec::with_capacity(part.sole.len()));
        Self { part, moves, lowest: 0, before, now, track: PartTrack::default() }
    }

    /// Height of the lowest vertex along the rig's up axis, in the scene's unit.
    fn lowest(&mut self, rows: &[Row]) -> f64 {
        let height;
        (height, self.lowest) = self.part.lowest(rows, self.lowest);
        height
    }

    /// The step that leads to a frame, where it is wanted; `index` counts the frames of the chunk.
    fn step(&mut self, index: usize, (turn, unit, model): (DQuat, f64, &[Transform]), touch: f64) {
        let is_wanted = |index: usize| self.moves.get(index).copied().unwrap_or_default();
        let leads_here = index.checked_sub(1).map(is_wanted);
        std::mem::swap(&mut self.before, &mut self.now);
        self.now.clear();
        if is_wanted(index) || leads_here == Some(true) {
            self.now.extend(self.part.places(model).map(|place| turn * place * unit));
        }
        if let Some(is_wanted) = leads_here {
            self.track.steps.push(is_wanted.then(|| step(&self.before, &self.now, touch)).flatten());
        }
    }
}

impl FootParts {
    fn find(rig: &Rig<'_>, wanted: &[WantedPart], leg: f64) -> Option<Self> {
        let skin = &*rig.scene.skin_vertices;
        if skin.is_empty() || wanted.is_empty() {
            return None;
        }
        let chosen: Vec<Vec<usize>> = wanted.iter().map(|part| part.choose(rig, skin)).collect();
        let is_whole = |part: &WantedPart| {
            let same = wanted.iter().zip(&chosen).filter(|(other, _)| other.joints == part.joints);
            same.map(|(_, vertices)| vertices.len()).sum::<usize>() >= FEW_VERTICES
        };
        if !wanted.iter().all(is_whole) {
            return None;
        }
        let influences = chosen.iter().flatten().flat_map(|&vertex| skin.of(vertex));
        let joints = rig.skeleton().with_ancestors(influences.map(|one| one.joint as usize));
        let share = |one: &Influence| Share {
            joint: joints.binary_search(&(one.joint as usize)).unwrap_or(0),
            weight: f64::from(one.weight),
            place: one.position.as_dvec3() * f64::from(one.weight),
        };
        let part = |vertices: &Vec<usize>| {
            let shares = |vertex: usize| skin.of(vertex).iter().map(share).collect::<Vec<Share>>();
            let place = |vertex: usize| skin.place(vertex, &rig.rest) * rig.unit_meters;
            let sole = sole(rig, skin, vertices, leg);
            let vertices = vertices.iter().map(|&vertex| (shares(vertex), place(vertex))).collect();
            Part { sole: sole.into_iter().map(shares).collect(), ..Part::of(vertices, CELL * leg) }
        };
        let parts = chosen.iter().map(part).collect();
        Some(Self { joints, parts })
    }
}

impl Part {
    /// Of vertices with their places at rest, and the size of a cell.
    fn of(vertices: Vec<(Vec<Share>, DVec3)>, cell: f64) -> Self {
        let joints = |shares: &[Share]| shares.iter().map(|share| share.joint).collect::<Vec<usize>>();
        #[expect(clippy::cast_possible_truncation, reason = "a few cells")]
        let cell_of = |place: DVec3| (place / cell.max(1e-9)).floor().to_array().map(|number| number as i64);
        let mut keyed: Vec<_> =
            vertices.into_iter().map(|(shares, place)| ((joints(&shares), cell_of(place)), shares)).collect();
        keyed.sort_by(|first, second| first.0.cmp(&second.0));
        let mut part = Self::default();
        let mut begin = 0;
        for index in 0..keyed.len() {
            part.shares.extend(&keyed[index].1);
            part.ends.push(part.shares.len());
            // Clusters may go on in the next cell, as cells may hold few vertices.
            let goes_on = keyed.get(index + 1).is_some_and(|next| {
                let is_near = next.0.1[0] == keyed[begin].0.1[0] && next.0.1[1] == keyed[begin].0.1[1];
                next.0.0 == keyed[begin].0.0 && is_near && index + 1 - begin < CLUSTER
            });
            if !goes_on {
                let own: Vec<&[Share]> = keyed[begin..=index].iter().map(|(_, shares)| shares.as_slice()).collect();
                part.clusters.push(Cluster::of(&own, begin..index + 1));
                begin = index + 1;
            }
        }
        part
    }

    fn vertex(&self, vertex: usize) -> &[Share] {
        let begin = if vertex == 0 { 0 } else { self.ends[vertex - 1] };
        &self.shares[begin..self.ends[vertex]]
    }

    /// The height of the lowest vertex, and its cluster. `first` is the cluster that is looked at first, best where it was lowest in the
    /// frame before.
    fn lowest(&self, rows: &[Row], first: usize) -> (f64, usize) {
        let mut found = (f64::INFINITY, first);
        for index in std::iter::once(first).chain((0..self.clusters.len()).filter(|index| *index != first)) {
            let cluster = &self.clusters[index];
            if cluster.lower_bound(rows) >= found.0 {
                continue;
            }
            for vertex in cluster.vertices.clone() {
                let height = height(self.vertex(vertex), rows);
                if height < found.0 {
                    found = (height, index);
                }
            }
        }
        found
    }

    /// Where the vertices of the sole are, in the scene's space and unit.
    fn places(&self, model: &[Transform]) -> impl Iterator<Item = DVec3> {
        self.sole.iter().map(|shares| {
            let place = |share: &Share| {
                let Transform { translation, rotation, scale } = model[share.joint];
                rotation * (scale * share.place) + translation * share.weight
            };
            shares.iter().map(place).sum()
        })
    }
}

impl Cluster {
    /// Of vertices with the same joints in the same order.
    fn of(vertices: &[&[Share]], range: Range<usize>) -> Self {
        let count = vertices.len() as f64;
        let mean = |index: usize| Share {
            joint: vertices[0][index].joint,
            weight: vertices.iter().map(|shares| shares[index].weight).sum::<f64>() / count,
            place: vertices.iter().map(|shares| shares[index].place).sum::<DVec3>() / count,
        };
        let middle: Vec<Share> = (0..vertices[0].len()).map(mean).collect();
        let distance = |shares: &&[Share]| {
            shares.iter().zip(&middle).map(|(own, mean)| own.place.distance(mean.place)).sum::<f64>()
        };
        let radius = vertices.iter().map(distance).fold(0.0, f64::max);
        let spread = |index: usize| {
            vertices.iter().map(|shares| (shares[index].weight - middle[index].weight).abs()).fold(0.0, f64::max)
        };
        let spread = (0..middle.len()).map(spread).collect();
        Self { vertices: range, middle, radius, spread }
    }

    /// No vertex is lower. Weights sum up to 1, so that their differences count by how far apart the joints are in height.
    fn lower_bound(&self, rows: &[Row]) -> f64 {
        let first = rows[self.middle[0].joint];
        let (mut reach, mut apart) = (0.0_f64, 0.0);
        for (share, spread) in self.middle.iter().zip(&self.spread) {
            let row = rows[share.joint];
            reach = reach.max(row.length);
            apart += spread * (row.height - first.height).abs();
        }
        height(&self.middle, rows) - self.radius * reach - apart
    }
}

fn height(shares: &[Share], rows: &[Row]) -> f64 {
    let share = |share: &Share| rows[share.joint].row.dot(share.place) + rows[share.joint].height * share.weight;
    shares.iter().map(share).sum()
}

/// How the vertices that touch the floor move over it on the whole, so that a foot which turns on the spot does not slide.
fn step(before: &[DVec3], now: &[DVec3], touch: f64) -> Option<DVec2> {
    let lowest = |places: &[DVec3]| places.iter().map(|place| place.y).fold(f64::INFINITY, f64::min) + touch;
    let (low_before, low_now) = (lowest(before), lowest(now));
    let level = |(before, now): (&DVec3, &DVec3)| (*now - *before).xz();
    let steps = |touches: &dyn Fn(&DVec3, &DVec3) -> bool| {
        let pairs = before.iter().zip(now).filter(|(before, now)| touches(before, now));
        let (sum, count) = pairs.map(level).fold((DVec2::ZERO, 0), |(sum, count), step| (sum + step, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    };
    // Where the foot rolls on so fast that no vertex touches in both frames, it is what touched.
    steps(&|before, now| before.y <= low_before && now.y <= low_now)
        .or_else(|| steps(&|before, _| before.y <= low_before))
}

impl WantedPart {
    fn choose(&self, rig: &Rig<'_>, skin: &SkinVertices) -> Vec<usize> {
        let skeleton = rig.skeleton();
        let mut is_foot = vec![false; skeleton.len()];
        for joint in 0..skeleton.len() {
            let is_below = skeleton.parent(joint).is_some_and(|parent| is_foot[parent]);
            is_foot[joint] = is_below || self.joints.contains(&joint);
        }
        let is_of_foot = |vertex: &usize| {
            let own = skin.of(*vertex).iter().filter(|one| is_foot[one.joint as usize]);
            own.map(|one| one.weight).sum::<f32>() >= SHARE_OF_FOOT
        };
        let vertices = (0..skin.len()).filter(is_of_foot);
        match self.half {
            None => vertices.collect(),
            Some(half) => vertices.filter(|vertex| half.has(rig, skin.place(*vertex, &rig.rest))).collect(),
        }
    }
}

impl Half {
    fn has(&self, rig: &Rig<'_>, place: DVec3) -> bool {
        let [ankle, ball] = [self.ankle, self.ball].map(|joint| rig.rest.transforms()[joint].translation);
        let along = (ball - ankle).reject_from_normalized(rig.up());
        ((place - ball).dot(along) >= 0.0) == self.is_front
    }
}

/// The lowest vertices at rest, evenly thinned out.
fn sole(rig: &Rig<'_>, skin: &SkinVertices, vertices: &[usize], leg: f64) -> Vec<usize> {
    let height = |vertex: usize| skin.place(vertex, &rig.rest).dot(rig.up()) * rig.unit_meters;
    let heights: Vec<f64> = vertices.iter().map(|&vertex| height(vertex)).collect();
    let most = heights.iter().copied().fold(f64::INFINITY, f64::min) + SOLE * leg;
    let low: Vec<usize> =
        vertices.iter().zip(heights).filter(|(_, height)| *height <= most).map(|(vertex, _)| *vertex).collect();
    let count = low.len().min(MAX_FOLLOWED);
    (0..count).map(|index| low[low.len() * index / count]).collect()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn the_lowest_of_all_vertices_is_found() {
        // A foot 26 cm long that bends at the ball, with thousands of vertices, and a shin above it.
        let mut vertices = Vec::new();
        for index in 0..4000_usize {
            let (turn, along) = (index as f64 * 2.399, (index % 97) as f64 / 97.0);
            let place = DVec3::new(0.045 * turn.cos(), 0.03 * turn.sin(), 0.26 * along - 0.06);
            let toe = ((place.z - 0.1) / 0.06).clamp(0.0, 1.0);
            let shin = (-place.z * 4.0).clamp(0.0, 0.2);
            let share =
                |joint: usize, weight: f64, origin: DVec3| Share { joint, weight, place: (place - origin) * weight };
            let mut shares = vec![share(0, 1.0 - toe - shin, DVec3::ZERO)];
            shares.extend((toe > 0.0).then(|| share(1, toe, DVec3::Z * 0.13)));
            shares.extend((shin > 0.0).then(|| share(2, shin, DVec3::Y * 0.4)));
            vertices.push((shares, place));
        }
        let part = Part::of(vertices, CELL);
        assert_eq!(part.ends.len(), 4000, "all are kept");
        let mut first = 0;
        for index in 0..500 {
            let angle = f64::from(index) * 0.05;
            let foot = DQuat::from_euler(glam::EulerRot::XYZ, angle, 0.3 * angle, (2.0 * angle).sin());
            let toe = foot * DQuat::from_rotation_x(-0.6 * angle.sin().abs());
            let shin = DQuat::from_rotation_x(0.4 * angle.cos());
            let row = |turn: DQuat, height: f64| {
                let row = turn.conjugate() * DVec3::Y;
                Row { row, length: row.length(), height }
            };
            let rows = [row(foot, 0.1), row(toe, 0.1 + (foot * DVec3::Z).y * 0.13), row(shin, 0.5)];
            let all = (0..4000).map(|vertex| height(part.vertex(vertex), &rows)).fold(f64::INFINITY, f64::min);
            let found;
            (found, first) = part.lowest(&rows, first);
            assert!((found - all).abs() < 1e-12, "pose {index}: {found} where {all} is lowest");
        }
    }

    #[test]
    fn a_foot_that_turns_on_the_spot_does_not_slide() {
        let corners = [
            DVec3::new(0.1, 0.0, 0.1),
            DVec3::new(-0.1, 0.0, 0.1),
            DVec3::new(0.1, 0.0, -0.1),
            DVec3::new(-0.1, 0.0, -0.1),
        ];
        let turned = corners.map(|corner| DQuat::from_rotation_y(0.2) * corner);
        assert!(step(&corners, &turned, 0.005).expect("it touches").length() < 1e-12, "turned");
        let moved = corners.map(|corner| corner + DVec3::X * 0.01);
        assert!((step(&corners, &moved, 0.005).expect("it touches").x - 0.01).abs() < 1e-12, "moved");
        assert!(step(&[], &[], 0.005).is_none(), "nothing touches");
    }
}
