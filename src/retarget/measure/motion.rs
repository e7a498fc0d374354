//! Where the points that metrics look at are, on both sides: forward kinematics of its own, so that nothing is taken over from
//! how the result was made.
//!
//! Everything comes out in meters, +Y up, +Z front, whatever the files' axes and units.

use std::ops::Range;

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;

use crate::{
    model::{Clip, ModelPose, Transform},
    rig::Rig,
};

/// Frames that one thread takes at a time.
pub(super) const CHUNK_FRAMES: usize = 256;

/// Frames that last longer, 24 a second, are not asked to change less: what a body does within one grows with its length, and with the
/// square of it where speeds change. Seconds.
pub(super) const LONGEST_FRAME_SECONDS: f64 = 1.0 / 24.0;

/// A point that is fixed to a joint.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    pub(super) joint: usize,
    /// In the joint's own space and the scene's unit.
    pub(super) offset: DVec3,
}

impl Anchor {
    /// Of a point in the scale of the scene.
    pub(super) fn of(rig: &Rig<'_>, anchor: crate::rig::Anchor) -> Self {
        let scale = rig.rest.transforms()[anchor.joint].scale;
        let scale = DVec3::select(scale.cmpeq(DVec3::ZERO), DVec3::ONE, scale);
        Self { joint: anchor.joint, offset: anchor.offset / scale }
    }

    pub(super) const fn at(joint: usize) -> Self {
        Self { joint, offset: DVec3::ZERO }
    }
}

/// The same on both sides.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Both<T> {
    pub(super) source: T,
    pub(super) target: T,
}

impl<T> Both<T> {
    pub(super) fn map<U>(&self, convert: impl Fn(&T) -> U) -> Both<U> {
        Both { source: convert(&self.source), target: convert(&self.target) }
    }
}

/// What metrics ask for before anything is computed. Slots count from 0 and are the same on both sides.
#[derive(Debug, Default)]
pub(super) struct Wanted {
    points: Vec<Both<Anchor>>,
    turns: Vec<Both<usize>>,
    /// Joints of one side alone whose turns are wanted.
    own_turns: Both<Vec<usize>>,
}

impl Wanted {
    /// Asks for the turn of a joint of one side; gives its slot for [`Motion::own_turn`].
    pub(super) fn own_turn(&mut self, is_target: bool, joint: usize) -> usize {
        let turns = if is_target { &mut self.own_turns.target } else { &mut self.own_turns.source };
        turns.push(joint);
        turns.len() - 1
    }

    /// Asks for a point; gives its slot.
    pub(super) fn point(&mut self, anchor: Both<Anchor>) -> usize {
        self.points.push(anchor);
        self.points.len() - 1
    }

    /// Asks for a joint's position; gives its slot.
    pub(super) fn joint(&mut self, joint: Both<usize>) -> usize {
        self.point(joint.map(|&joint| Anchor::at(joint)))
    }

    /// Asks for a joint's turn since the rest pose; gives its slot.
    pub(super) fn turn(&mut self, joint: Both<usize>) -> usize {
        self.turns.push(joint);
        self.turns.len() - 1
    }
}

/// Which frames are looked at: all, or runs of neighbors that are spread evenly.
#[derive(Debug)]
pub(super) struct Frames {
    pub(super) indices: Vec<usize>,
    /// Which of `indices` are neighbors in the clip.
    pub(super) runs: Vec<Range<usize>>,
}

impl Frames {
    pub(super) fn all(count: usize) -> Self {
        Self { indices: (0..count).collect(), runs: std::iter::once(0..count).collect() }
    }

    /// At most about `most` frames, in runs of `run`.
    pub(super) fn spread(count: usize, most: usize, run: usize) -> Self {
        if count <= most {
            return Self::all(count);
        }
        let runs = (most / run).max(2);
        let (mut indices, mut ranges) = (Vec::with_capacity(runs * run), Vec::with_capacity(runs));
        for index in 0..runs {
            let first = (count - run) * index / (runs - 1);
            ranges.push(indices.len()..indices.len() + run);
            indices.extend(first..first + run);
        }
        Self { indices, runs: ranges }
    }

    /// The same, where frames on both sides of a cut are no neighbors. `cuts` are the frames behind them, rising.
    pub(super) fn cut_at(mut self, cuts: &[usize]) -> Self {
        for cut in cuts {
            let place = self.indices.partition_point(|frame| frame < cut);
            let Some(run) = self.runs.iter().position(|run| run.start < place && place < run.end) else { continue };
            let before = self.runs[run].start..place;
            self.runs[run].start = place;
            self.runs.insert(run, before);
        }
        self
    }
}

/// One side's points and turns at some frames.
#[derive(Debug)]
pub(super) struct Motion {
    points: usize,
    turns: usize,
    /// How many of the turns are those of both sides.
    common_turns: usize,
    positions: Vec<Vec3>,
    rotations: Vec<Quat>,
}

impl Motion {
    /// Where a point is, in meters, +Y up. `frame` counts the frames that were looked at.
    pub(super) fn position(&self, frame: usize, point: usize) -> DVec3 {
        self.positions[frame * self.points + point].as_dvec3()
    }

    /// How a joint is turned since the rest pose: `G(t) · G_rest⁻¹`.
    pub(super) fn turn(&self, frame: usize, turn: usize) -> DQuat {
        self.rotations[frame * self.turns + turn].as_dquat()
    }

    /// The same of a joint that was wanted of this side alone.
    pub(super) fn own_turn(&self, frame: usize, turn: usize) -> DQuat {
        self.turn(frame, self.common_turns + turn)
    }
}

/// Both sides at the same frames.
#[derive(Debug)]
pub(super) struct Compared {
    pub(super) frames: Frames,
    /// Key time of every frame looked at.
    pub(super) times_seconds: Vec<f64>,
    /// The same on the clock of the performance, by which speeds are judged: a clip that was slowed down is as good as it was.
    pub(super) performed_seconds: Vec<f64>,
    pub(super) source: Motion,
    pub(super) target: Motion,
}

impl Compared {
    pub(super) fn len(&self) -> usize {
        self.frames.indices.len()
    }

    pub(super) fn side(&self, is_target: bool) -> &Motion {
        if is_target { &self.target } else { &self.source }
    }
}

/// One side: the rig, the pose that turns are counted from, and the clip.
#[derive(Clone, Copy, Debug)]
pub(super) struct Performer<'a> {
    pub(super) rig: &'a Rig<'a>,
    pub(super) rest: &'a ModelPose,
    pub(super) clip: &'a Clip,
}

/// Computes what is wanted.
pub(super) fn compare(performers: &Both<Performer<'_>>, wanted: &Wanted, frames: Frames) -> Compared {
    let clip = performers.target.clip;
    let common = wanted.turns.len();
    let side = |performer: &Performer<'_>, points: Vec<Anchor>, turns: Vec<usize>| Motion {
        common_turns: common,
        ..Kinematics::new(performer, &points, &turns).run(&frames.indices)
    };
    let points = |pick: fn(&Both<Anchor>) -> Anchor| wanted.points.iter().map(pick).collect();
    let turns = |pick: fn(&Both<usize>) -> usize, own: &[usize]| {
        wanted.turns.iter().map(pick).chain(own.iter().copied()).collect()
    };
    let source =
        side(&performers.source, points(|both| both.source), turns(|both| both.source, &wanted.own_turns.source));
    let target =
        side(&performers.target, points(|both| both.target), turns(|both| both.target, &wanted.own_turns.target));
    let times_seconds: Vec<f64> = frames.indices.iter().map(|&frame| clip.times_seconds()[frame]).collect();
    let tempo = performers.source.clip.tempo();
    let performed_seconds = times_seconds.iter().map(|time| time * tempo).collect();
    Compared { frames, times_seconds, performed_seconds, source, target }
}

/// The joints that some points need, parents first, in a numbering of their own.
pub(super) struct Kinematics<'a> {
    performer: Performer<'a>,
    joints: Vec<usize>,
    parents: Vec<Option<usize>>,
    points: Vec<(usize, DVec3)>,
    /// Number, and what comes after the rotation: the inverse of the one at rest, and of the turn to +Y up.
    turns: Vec<(usize, DQuat)>,
}

impl<'a> Kinematics<'a> {
    /// Only what [`Self::pose`] needs.
    pub(super) fn of_joints(performer: &Performer<'a>, joints: &[usize]) -> Self {
        let points: Vec<Anchor> = joints.iter().map(|&joint| Anchor::at(joint)).collect();
        Self::of_points(performer, &points)
    }

    /// Only points.
    pub(super) fn of_points(performer: &Performer<'a>, points: &[Anchor]) -> Self {
        Self::new(performer, points, &[])
    }

    /// How many joints there are.
    pub(super) fn len(&self) -> usize {
        self.joints.len()
    }

    /// `model_from_joint` of every joint in a frame of the clip, in the scene's space and unit.
    pub(super) fn pose(&self, frame: usize, model: &mut [Transform]) {
        let Performer { rig, clip, .. } = self.performer;
        for (position, &joint) in self.joints.iter().enumerate() {
            let (tracks, rest) = (&clip.joints()[joint], &rig.skeleton().joints()[joint].rest);
            let local = Transform {
                translation: tracks.translation.wide_at(frame, rest.translation),
                rotation: unit(tracks.rotation.wide_at(frame, rest.rotation)),
                scale: tracks.scale.wide_at(frame, rest.scale),
            };
            model[position] = self.parents[position].map_or(local, |parent| model[parent].then_child(&local));
        }
    }

    fn new(performer: &Performer<'a>, points: &[Anchor], turns: &[usize]) -> Self {
        let skeleton = performer.rig.skeleton();
        let joints = skeleton.with_ancestors(points.iter().map(|anchor| anchor.joint).chain(turns.iter().copied()));
        let mut number = vec![0; skeleton.len()];
        for (position, &joint) in joints.iter().enumerate() {
            number[joint] = position;
        }
        let rest = performer.rest.transforms();
        let scene_from_canonical = performer.rig.canonical_from_scene.conjugate();
        let after = |joint: usize| unit(rest[joint].rotation).conjugate() * scene_from_canonical;
        Self {
            performer: *performer,
            parents: joints.iter().map(|&joint| skeleton.parent(joint).map(|parent| number[parent])).collect(),
            points: points.iter().map(|anchor| (number[anchor.joint], anchor.offset)).collect(),
            turns: turns.iter().map(|&joint| (number[joint], after(joint))).collect(),
            joints,
        }
    }

    /// Points and turns at some frames of the clip.
    pub(super) fn run(&self, frames: &[usize]) -> Motion {
        let (points, turns) = (self.points.len(), self.turns.len());
        let mut positions = vec![Vec3::ZERO; frames.len() * points];
        let mut rotations = vec![Quat::IDENTITY; frames.len() * turns];
        // One chunk per run of frames, whichever of the two lists is empty.
        let mut rest = (positions.as_mut_slice(), rotations.as_mut_slice());
        let mut chunks = Vec::with_capacity(frames.len().div_ceil(CHUNK_FRAMES));
        for frames in frames.chunks(CHUNK_FRAMES) {
            let (positions, later_positions) = rest.0.split_at_mut(frames.len() * points);
            let (rotations, later_rotations) = rest.1.split_at_mut(frames.len() * turns);
            rest = (later_positions, later_rotations);
            chunks.push((frames, positions, rotations));
        }
        chunks.into_par_iter().for_each(|(frames, positions, rotations)| self.fill(frames, positions, rotations));
        Motion { points, turns, common_turns: turns, positions, rotations }
    }

    fn fill(&self, frames: &[usize], positions: &mut [Vec3], rotations: &mut [Quat]) {
        let rig = self.performer.rig;
        let work = rig.canonical_from_scene;
        let (points, turns) = (self.points.len(), self.turns.len());
        let mut model = vec![Transform::IDENTITY; self.joints.len()];
        for (index, &frame) in frames.iter().enumerate() {
            self.pose(frame, &mut model);
            for (result, (joint, offset)) in positions[index * points..].iter_mut().zip(&self.points) {
                let joint = &model[*joint];
                let place = if *offset == DVec3::ZERO { joint.translation } else { joint.transform_point(*offset) };
                *result = (work * place * rig.unit_meters).as_vec3();
            }
            for (result, (joint, after)) in rotations[index * turns..].iter_mut().zip(&self.turns) {
                *result = (work * model[*joint].rotation * *after).as_quat();
            }
        }
    }
}

/// A rotation that is one, whatever a file says.
fn unit(rotation: DQuat) -> DQuat {
    let length = rotation.length();
    if length > 1e-9 && length.is_finite() { rotation / length } else { DQuat::IDENTITY }
}
