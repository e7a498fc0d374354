//! The vertices of the feet, skinned in every frame: how low each part of a foot is, and how it moves over the floor.
//!
//! A foot's vertices are those that its joints move by at least half. Everything comes out in meters.

use std::sync::Arc;

use glam::{DQuat, DVec2, DVec3, swizzles::Vec3Swizzles};
use rayon::prelude::*;

use super::{
    motion::{CHUNK_FRAMES, Kinematics, Performer},
    vertex_set::{Row, Share, VertexSet},
};
use crate::{
    model::{SkinVertices, Transform},
    rig::{Rig, rig_memory::Question},
};

/// The share of a vertex that the joints of a foot move if it is one of the foot's.
const SHARE_OF_FOOT: f32 = 0.5;
/// The way over the floor is that of vertices that the foot moves by this share, where there are so many: the heel of a soft mesh is pulled along
/// by the shin, whatever the foot does, and nobody takes that for a slide.
const SHARE_OF_SOLE: f32 = 0.9;
const FEW_OF_SOLE: usize = 4;
/// Fewer vertices are no foot.
const FEW_VERTICES: usize = 8;
/// Vertices this much above the lowest one at rest can touch the floor, in leg lengths, and how many of them are followed.
const SOLE: f64 = 0.03;
const MAX_FOLLOWED: usize = 24;
/// Followed vertices this close to the lowest one touch the floor, in leg lengths.
const TOUCH: f64 = 0.005;
/// A part of a foot that stands by itself: heel, ball, or a paw as a whole.
#[derive(Debug, Default)]
struct Part {
    /// All vertices.
    vertices: VertexSet,
    /// Vertices of the sole, whose way over the floor is followed.
    sole: Vec<Vec<Share>>,
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
    pub(super) steps: Vec<Option<Step>>,
}

/// What touches the floor, on its way to the next frame: the mean of its vertices, meters, +Y up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    pub(super) from: DVec3,
    pub(super) way: DVec2,
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
                *row = Row::of(joint, up);
            }
            for followed in &mut parts {
                if index < frames.len() && !followed.part.vertices.is_empty() {
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
        (height, self.lowest) = self.part.vertices.lowest(rows, self.lowest);
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
        let shares = |vertex: usize| skin.of(vertex).iter().map(|one| Share::of(one, &joints)).collect::<Vec<Share>>();
        let part = |(wanted, vertices): (&WantedPart, &Vec<usize>)| Part {
            vertices: VertexSet::of_skin(rig, vertices, &joints, leg),
            sole: wanted.sole(rig, skin, vertices, leg).into_iter().map(shares).collect(),
        };
        let parts = wanted.iter().zip(&chosen).map(part).collect();
        Some(Self { joints, parts })
    }
}

impl Part {
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

/// How the vertices that touch the floor move over it on the whole, so that a foot which turns on the spot does not slide.
fn step(before: &[DVec3], now: &[DVec3], touch: f64) -> Option<Step> {
    let lowest = |places: &[DVec3]| places.iter().map(|place| place.y).fold(f64::INFINITY, f64::min) + touch;
    let (low_before, low_now) = (lowest(before), lowest(now));
    let steps = |touches: &dyn Fn(&DVec3, &DVec3) -> bool| {
        let pairs = before.iter().zip(now).filter(|(before, now)| touches(before, now));
        let sums = |(from, to, count), (before, now): (&DVec3, &DVec3)| (from + *before, to + *now, count + 1);
        let (from, to, count) = pairs.fold((DVec3::ZERO, DVec3::ZERO, 0), sums);
        let mean = |sum: DVec3| sum / f64::from(count);
        (count > 0).then(|| Step { from: mean(from), way: mean(to - from).xz() })
    };
    // Where the foot rolls on so fast that no vertex touches in both frames, it is what touched.
    steps(&|before, now| before.y <= low_before && now.y <= low_now)
        .or_else(|| steps(&|before, _| before.y <= low_before))
}

impl WantedPart {
    fn choose(&self, rig: &Rig<'_>, skin: &SkinVertices) -> Vec<usize> {
        let shares = self.shares(rig, skin);
        let vertices = (0..skin.len()).filter(|&vertex| shares(vertex) >= SHARE_OF_FOOT);
        match self.half {
            None => vertices.collect(),
            Some(half) => vertices.filter(|vertex| half.has(rig, skin.place(*vertex, &rig.rest))).collect(),
        }
    }

    /// By how much the joints of the foot, and those below them, move a vertex.
    fn shares<'a>(&self, rig: &Rig<'_>, skin: &'a SkinVertices) -> impl Fn(usize) -> f32 + use<'a> {
        let skeleton = rig.skeleton();
        let mut is_foot = vec![false; skeleton.len()];
        for joint in 0..skeleton.len() {
            let is_below = skeleton.parent(joint).is_some_and(|parent| is_foot[parent]);
            is_foot[joint] = is_below || self.joints.contains(&joint);
        }
        move |vertex| {
            let own = skin.of(vertex).iter().filter(|one| is_foot[one.joint as usize]);
            own.map(|one| one.weight).sum()
        }
    }

    /// The lowest vertices at rest of those that the foot moves alone, evenly thinned out.
    fn sole(&self, rig: &Rig<'_>, skin: &SkinVertices, vertices: &[usize], leg: f64) -> Vec<usize> {
        let height = |vertex: usize| skin.place(vertex, &rig.rest).dot(rig.up()) * rig.unit_meters;
        let heights: Vec<f64> = vertices.iter().map(|&vertex| height(vertex)).collect();
        let most = heights.iter().copied().fold(f64::INFINITY, f64::min) + SOLE * leg;
        let low = vertices.iter().zip(heights).filter(|(_, height)| *height <= most).map(|(vertex, _)| *vertex);
        let mut low: Vec<usize> = low.collect();
        let shares = self.shares(rig, skin);
        let firm: Vec<usize> = low.iter().copied().filter(|&vertex| shares(vertex) >= SHARE_OF_SOLE).collect();
        if firm.len() >= FEW_OF_SOLE {
            low = firm;
        }
        let count = low.len().min(MAX_FOLLOWED);
        (0..count).map(|index| low[low.len() * index / count]).collect()
    }
}

impl Half {
    fn has(&self, rig: &Rig<'_>, place: DVec3) -> bool {
        let [ankle, ball] = [self.ankle, self.ball].map(|joint| rig.rest.transforms()[joint].translation);
        let along = (ball - ankle).reject_from_normalized(rig.up());
        ((place - ball).dot(along) >= 0.0) == self.is_front
    }
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn a_foot_that_turns_on_the_spot_does_not_slide() {
        let corners = [
            DVec3::new(0.1, 0.0, 0.1),
            DVec3::new(-0.1, 0.0, 0.1),
            DVec3::new(0.1, 0.0, -0.1),
            DVec3::new(-0.1, 0.0, -0.1),
        ];
        let turned = corners.map(|corner| DQuat::from_rotation_y(0.2) * corner);
        assert!(step(&corners, &turned, 0.005).expect("it touches").way.length() < 1e-12, "turned");
        let moved = corners.map(|corner| corner + DVec3::X * 0.01);
        assert!((step(&corners, &moved, 0.005).expect("it touches").way.x - 0.01).abs() < 1e-12, "moved");
        assert!(step(&[], &[], 0.005).is_none(), "nothing touches");
    }
}
