//! The vertices of the feet, skinned in every frame: how low each part of a foot is, and how it moves over the floor.
//!
//! Linear blend skinning with all influences. A foot's vertices are those that its joints move by at least half. Heights need one
//! dot product per influence, so every vertex is looked at; only where a clip is long are vertices left out that others always
//! undercut. Everything comes out in metres.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3, swizzles::Vec3Swizzles};
use rayon::prelude::*;

use super::motion::{CHUNK_FRAMES, Kinematics, Performer};
use crate::{
    model::{Influence, SkinVertices, Transform},
    rig::Rig,
};

/// The share of a vertex that the joints of a foot move if it is one of the foot's.
const SHARE_OF_FOOT: f32 = 0.5;
/// Fewer vertices are no foot.
const FEW_VERTICES: usize = 8;
/// Vertices this much above the lowest one at rest can touch the floor, in leg lengths, and how many of them are followed.
const SOLE: f64 = 0.03;
const MAX_FOLLOWED: usize = 64;
/// Followed vertices this close to the lowest one touch the floor, in leg lengths.
const TOUCH: f64 = 0.005;
/// Directions in which the outermost vertices are kept, and steps of a weight within which vertices move alike.
const DIRECTIONS: usize = 256;
const WEIGHT_STEPS: f32 = 8.0;

/// A part of a foot that stands by itself: heel, ball, or a paw as a whole.
#[derive(Debug, Default)]
struct Part {
    /// All vertices that can be lowest.
    lowest: Vertices,
    /// Vertices of the sole, whose way over the floor is followed.
    sole: Vertices,
}

/// Vertices as their joints' numbers in [`Kinematics`] and weighted positions.
#[derive(Debug, Default)]
struct Vertices {
    shares: Vec<(u32, f32, DVec3)>,
    ends: Vec<usize>,
}

impl Vertices {
    fn push(&mut self, influences: &[Influence], number: impl Fn(usize) -> usize) {
        self.shares.extend(influences.iter().map(|one| {
            #[expect(clippy::cast_possible_truncation, reason = "a joint's number")]
            let joint = number(one.joint as usize) as u32;
            (joint, one.weight, one.position.as_dvec3() * f64::from(one.weight))
        }));
        self.ends.push(self.shares.len());
    }

    fn each(&self) -> impl Iterator<Item = &[(u32, f32, DVec3)]> {
        let mut begin = 0;
        self.ends.iter().map(move |end| &self.shares[std::mem::replace(&mut begin, *end)..*end])
    }
}

/// What is looked at on one rig.
pub(super) struct FootSkin<'a> {
    performer: Performer<'a>,
    kinematics: Kinematics<'a>,
    parts: Vec<Part>,
    leg: f64,
}

/// One part of a foot over the clip.
#[derive(Debug, Default)]
pub(super) struct PartTrack {
    /// Height of the lowest vertex per frame, metres; empty where the part has no vertices.
    pub(super) heights: Vec<f32>,
    /// How far what touches the floor moves over it until the next frame, metres.
    pub(super) steps: Vec<DVec2>,
}

/// A part to look for: the joints whose vertices count, and where a foot is divided.
pub(super) struct WantedPart {
    /// The joints of the foot: with all that is below them.
    pub(super) joints: Vec<usize>,
    /// The part of the foot on one side of the ball; all of the foot where nothing.
    pub(super) half: Option<Half>,
}

/// One side of the ball of a foot.
#[derive(Clone, Copy, Debug)]
pub(super) struct Half {
    /// Whether it is the toes' side.
    pub(super) is_front: bool,
    /// Of the ankle and the ball.
    pub(super) ankle: usize,
    /// Likewise.
    pub(super) ball: usize,
}

impl<'a> FootSkin<'a> {
    /// Nothing where a foot has no vertices, so that both feet are measured alike. `leg` is the leg in metres, `frames` how many will
    /// be looked at.
    pub(super) fn find(performer: Performer<'a>, wanted: &[WantedPart], leg: f64, frames: usize) -> Option<Self> {
        let skin = &*performer.rig.scene.skin_vertices;
        if skin.is_empty() || wanted.is_empty() {
            return None;
        }
        let chosen: Vec<Vec<usize>> = wanted.iter().map(|part| part.choose(performer.rig, skin)).collect();
        let is_whole = |part: &WantedPart| {
            let same = wanted.iter().zip(&chosen).filter(|(other, _)| other.joints == part.joints);
            same.map(|(_, vertices)| vertices.len()).sum::<usize>() >= FEW_VERTICES
        };
        if !wanted.iter().all(is_whole) {
            return None;
        }
        let mut joints: Vec<usize> = Vec::new();
        chosen.iter().flatten().for_each(|&vertex| joints.extend(skin.of(vertex).iter().map(|one| one.joint as usize)));
        joints.sort_unstable();
        joints.dedup();
        let kinematics = Kinematics::of_joints(&performer, &joints);
        let part = |vertices: &Vec<usize>| {
            let kept = if frames > DIRECTIONS { outermost(skin, vertices) } else { vertices.clone() };
            let mut part = Part::default();
            kept.iter().for_each(|&vertex| part.lowest.push(skin.of(vertex), |joint| kinematics.number(joint)));
            for vertex in sole(performer.rig, skin, vertices, leg) {
                part.sole.push(skin.of(vertex), |joint| kinematics.number(joint));
            }
            part
        };
        let parts = chosen.iter().map(part).collect();
        Some(Self { performer, kinematics, parts, leg })
    }

    /// Follows every part over frames that are neighbours.
    pub(super) fn follow(&self, frames: &[usize]) -> Vec<PartTrack> {
        let chunks: Vec<Vec<PartTrack>> = frames
            .par_chunks(CHUNK_FRAMES)
            .enumerate()
            .map(|(chunk, own)| self.follow_chunk(own, frames.get((chunk + 1) * CHUNK_FRAMES).copied()))
            .collect();
        let mut tracks: Vec<PartTrack> = self.parts.iter().map(|_| PartTrack::default()).collect();
        for (track, part) in chunks.into_iter().flat_map(|chunk| chunk.into_iter().enumerate().map(|(part, track)| (track, part))) {
            tracks[part].heights.extend(track.heights);
            tracks[part].steps.extend(track.steps);
        }
        tracks
    }

    /// `next` is the frame after the chunk, which its last step leads to.
    fn follow_chunk(&self, frames: &[usize], next: Option<usize>) -> Vec<PartTrack> {
        let rig = self.performer.rig;
        let (unit, up) = (rig.unit_metres, rig.up());
        let mut model = vec![Transform::IDENTITY; self.kinematics.len()];
        let mut rows = vec![(DVec3::ZERO, 0.0); self.kinematics.len()];
        let mut tracks: Vec<PartTrack> = self.parts.iter().map(|_| PartTrack::default()).collect();
        let mut before: Vec<Vec<DVec3>> = Vec::new();
        for frame in frames.iter().copied().chain(next) {
            self.kinematics.pose(frame, &mut model);
            for (row, joint) in rows.iter_mut().zip(&model) {
                *row = (joint.rotation.conjugate() * up * joint.scale, joint.translation.dot(up));
            }
            let mut now: Vec<Vec<DVec3>> = Vec::with_capacity(self.parts.len());
            for (part, track) in self.parts.iter().zip(&mut tracks) {
                if track.heights.len() < frames.len() && !part.lowest.ends.is_empty() {
                    #[expect(clippy::cast_possible_truncation, reason = "metres")]
                    track.heights.push((part.lowest_height(&rows) * unit) as f32);
                }
                now.push(part.places(&model).map(|place| rig.work_from_scene * place * unit).collect());
            }
            for ((track, before), now) in tracks.iter_mut().zip(&before).zip(&now) {
                track.steps.extend(step(before, now, TOUCH * self.leg));
            }
            before = now;
        }
        tracks
    }
}

impl Part {
    fn lowest_height(&self, rows: &[(DVec3, f64)]) -> f64 {
        let height = |shares: &[(u32, f32, DVec3)]| {
            let share = |(joint, weight, position): &(u32, f32, DVec3)| {
                let (row, height) = &rows[*joint as usize];
                row.dot(*position) + height * f64::from(*weight)
            };
            shares.iter().map(share).sum::<f64>()
        };
        self.lowest.each().map(height).fold(f64::INFINITY, f64::min)
    }

    fn places<'m>(&self, model: &'m [Transform]) -> impl Iterator<Item = DVec3> + use<'m, '_> {
        self.sole.each().map(|shares| {
            let place = |(joint, weight, position): &(u32, f32, DVec3)| {
                let joint = &model[*joint as usize];
                joint.rotation * (joint.scale * *position) + joint.translation * f64::from(*weight)
            };
            shares.iter().map(place).sum()
        })
    }
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
    steps(&|before, now| before.y <= low_before && now.y <= low_now).or_else(|| steps(&|before, _| before.y <= low_before))
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
    let height = |vertex: usize| skin.place(vertex, &rig.rest).dot(rig.up()) * rig.unit_metres;
    let heights: Vec<f64> = vertices.iter().map(|&vertex| height(vertex)).collect();
    let most = heights.iter().copied().fold(f64::INFINITY, f64::min) + SOLE * leg;
    let low: Vec<usize> = vertices.iter().zip(heights).filter(|(_, height)| *height <= most).map(|(vertex, _)| *vertex).collect();
    let count = low.len().min(MAX_FOLLOWED);
    (0..count).map(|index| low[low.len() * index / count]).collect()
}

/// Vertices of which one may be the lowest, whichever way the foot is turned: of those that move alike, the outermost ones in
/// evenly spread directions.
fn outermost(skin: &SkinVertices, vertices: &[usize]) -> Vec<usize> {
    let mut alike: BTreeMap<Vec<(u32, u8)>, Vec<usize>> = BTreeMap::new();
    for &vertex in vertices {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share from 0 to 1")]
        let share = |one: &Influence| (one.joint, (one.weight * WEIGHT_STEPS).round() as u8);
        let mut key: Vec<(u32, u8)> = skin.of(vertex).iter().map(share).filter(|(_, share)| *share > 0).collect();
        key.sort_unstable();
        alike.entry(key).or_default().push(vertex);
    }
    let directions: Vec<DVec3> = (0..DIRECTIONS).map(direction).collect();
    let mut kept = Vec::new();
    for (key, vertices) in alike {
        let heaviest = key.iter().max_by_key(|(_, share)| *share).map(|(joint, _)| *joint);
        if vertices.len() <= DIRECTIONS {
            kept.extend(vertices);
            continue;
        }
        let place = |vertex: usize| {
            let own = skin.of(vertex).iter().find(|one| Some(one.joint) == heaviest);
            own.map_or(DVec3::ZERO, |one| one.position.as_dvec3())
        };
        let places: Vec<DVec3> = vertices.iter().map(|&vertex| place(vertex)).collect();
        let mut outer: Vec<usize> = directions
            .iter()
            .filter_map(|direction| {
                let far = places.iter().map(|place| place.dot(*direction)).enumerate();
                far.max_by(|first, second| first.1.total_cmp(&second.1)).map(|(index, _)| vertices[index])
            })
            .collect();
        outer.sort_unstable();
        outer.dedup();
        kept.extend(outer);
    }
    kept.sort_unstable();
    kept
}

/// Directions spread evenly over the sphere, on a spiral.
fn direction(index: usize) -> DVec3 {
    let height = 1.0 - (2 * index + 1) as f64 / DIRECTIONS as f64;
    let turn = index as f64 * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let radius = (1.0 - height * height).sqrt();
    DVec3::new(radius * turn.cos(), height, radius * turn.sin())
}

#[cfg(test)]
mod tests {
    use glam::{DQuat, Vec3};

    use super::*;

    #[test]
    fn what_is_left_out_is_never_lowest_by_much() {
        // A foot as two rounded boxes 26 cm long that bend at the ball, with thousands of vertices.
        let mut skin = SkinVertices::default();
        let mut all = Vec::new();
        for index in 0..6000_usize {
            let spread = direction(index * 7 % DIRECTIONS) * (0.9 + 0.1 * (index as f64 * 0.37).sin());
            let place = (spread * DVec3::new(0.045, 0.03, 0.13)).as_vec3() + Vec3::new(0.0, 0.0, (index % 13) as f32 * 1e-3);
            #[expect(clippy::cast_possible_truncation, reason = "a weight")]
            let toe = ((f64::from(place.z) - 0.03) / 0.06).clamp(0.0, 1.0) as f32;
            let mut influences = vec![
                Influence { joint: 0, weight: 1.0 - toe, position: place },
                Influence { joint: 1, weight: toe, position: place - Vec3::new(0.0, 0.0, 0.06) },
            ];
            skin.push(&mut influences, true);
            all.push(index);
        }
        let kept = outermost(&skin, &all);
        assert!(kept.len() < all.len() / 2, "most are left out: {}", kept.len());
        let lowest = |vertices: &[usize], pose: &[Transform; 2]| {
            let height = |one: &Influence| pose[one.joint as usize].transform_point(one.position.as_dvec3()).y * f64::from(one.weight);
            vertices.iter().map(|&vertex| skin.of(vertex).iter().map(height).sum::<f64>()).fold(f64::INFINITY, f64::min)
        };
        for index in 0..DIRECTIONS {
            let rotation = DQuat::from_rotation_arc(DVec3::Y, direction(index));
            let foot = Transform { rotation, ..Transform::IDENTITY };
            let bend = DQuat::from_rotation_x((index % 60) as f64 * -0.01);
            let toe = foot.then_child(&Transform { rotation: bend, ..Transform::from_translation(DVec3::Z * 0.06) });
            let pose = [foot, toe];
            let off = lowest(&kept, &pose) - lowest(&all, &pose);
            assert!((0.0..0.001).contains(&off), "{off} m in direction {index}");
        }
    }

    #[test]
    fn a_foot_that_turns_on_the_spot_does_not_slide() {
        let corners = [DVec3::new(0.1, 0.0, 0.1), DVec3::new(-0.1, 0.0, 0.1), DVec3::new(0.1, 0.0, -0.1), DVec3::new(-0.1, 0.0, -0.1)];
        let turned = corners.map(|corner| DQuat::from_rotation_y(0.2) * corner);
        assert!(step(&corners, &turned, 0.005).expect("it touches").length() < 1e-12, "turned");
        let moved = corners.map(|corner| corner + DVec3::X * 0.01);
        assert!((step(&corners, &moved, 0.005).expect("it touches").x - 0.01).abs() < 1e-12, "moved");
        assert!(step(&[], &[], 0.005).is_none(), "nothing touches");
    }
}
