//! What the stages of one retarget hand on to each other.

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;

use crate::model::{Canceled, Control, JointTracks, Track};

use super::{
    clock::{Clock, Moment},
    contact_points::ContactPoints,
};

/// Frames that one thread takes at a time.
pub(in crate::retarget) const CHUNK_FRAMES: usize = 64;

/// The state between two stages.
pub(in crate::retarget) struct Work<'a> {
    pub(in crate::retarget) control: &'a Control,
    /// Which frames are the clip, and which frame of it is shown by the others.
    pub(in crate::retarget) clock: Clock,
    /// Key times.
    pub(in crate::retarget) times: &'a [f64],
    /// The same on the clock of the performance, by which speeds are judged and poses smoothed.
    pub(in crate::retarget) performed: &'a [f64],
    /// Tracks of the source, joint by joint.
    pub(in crate::retarget) source: &'a [JointTracks],
    /// Tracks of the target so far.
    pub(in crate::retarget) target: Vec<JointTracks>,
    /// What was found to touch.
    pub(in crate::retarget) contacts: ContactPoints,
    /// Goals frame by frame, one per limb of the mapping; empty before a stage sets some.
    pub(in crate::retarget) goals: Vec<Goal>,
    /// Heights of the source's soles in plan space, frame by frame, one list per limb of the mapping; empty where they are not known yet.
    pub(in crate::retarget) source_soles: Vec<Vec<f64>>,
    /// When the trunk rests on the floor, frame by frame; empty where it never does, nothing where that is not known yet.
    pub(in crate::retarget) resting: Option<Vec<Resting>>,
    /// How far the pelvis is to be moved beside what makes held feet reachable, frame by frame; empty where it is not.
    pub(in crate::retarget) pelvis_moves: Vec<DVec3>,
    /// Distance that is left between goal and end, frame by frame, one per limb; in plan units. Not a number for limbs without goals.
    pub(in crate::retarget) residuals: Vec<f32>,
    /// What `limits` ops took back so far.
    pub(in crate::retarget) limited: Vec<LimitedJoint>,
}

/// How much the trunk of the source rests on the floor at a frame. Smooth over time.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Resting {
    /// It lies there, and decides how high the pelvis is.
    pub(in crate::retarget) decides: RestingPart,
    /// It is near the floor, or lies there.
    pub(in crate::retarget) near: RestingPart,
}

/// By how much a trunk rests, 0 to 1, and how far the target's is moved up for that: that share of what it is off by.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct RestingPart {
    pub(in crate::retarget) share: f64,
    pub(in crate::retarget) shift: f64,
}

impl Resting {
    /// How far the pelvis is moved up where feet ask for so much.
    pub(in crate::retarget) fn shift(&self, of_feet: f64) -> f64 {
        let of = |part: &RestingPart| of_feet + part.shift - of_feet * part.share;
        of(&self.decides).max(of(&self.near))
    }
}

/// What a `limits` op took back at one joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LimitedJoint {
    /// Joint of the target.
    pub joint: usize,
    /// Frames in which it was turned back.
    pub frames: usize,
    /// The largest angle by which it was, degrees.
    pub worst_degrees: f64,
    /// The frame of that.
    pub worst_frame: usize,
}

impl LimitedJoint {
    /// The same, with what was taken back at the joint in a section that begins so late in the clip.
    #[must_use]
    pub fn with_section(self, other: Self, first_frame: usize) -> Self {
        let is_worse = other.worst_degrees > self.worst_degrees;
        Self {
            joint: self.joint,
            frames: self.frames + other.frames,
            worst_degrees: self.worst_degrees.max(other.worst_degrees),
            worst_frame: if is_worse { first_frame + other.worst_frame } else { self.worst_frame },
        }
    }
}

/// Where the end of a limb should be, in plan space.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Goal {
    pub(in crate::retarget) position: DVec3,
    pub(in crate::retarget) rotation: DQuat,
    /// Which way the middle joint should point, from the line between start and end; its length is how sure that is, 0 to 1.
    pub(in crate::retarget) pole: DVec3,
    /// The share of its length to which the source's limb is extended.
    pub(in crate::retarget) extension: f64,
    /// How far the limb reaches: the distances from its start to its middle and on to its end.
    pub(in crate::retarget) length: f64,
    /// How far the goal is from the limb's start as the op sets it that gives the limb its goal, before others move it.
    pub(in crate::retarget) span: f64,
    /// How much the goal is one that the foot must not leave, 0 to 1.
    pub(in crate::retarget) hold: f64,
    /// How far it may be lowered before the sole meets the floor, as far as that is known.
    pub(in crate::retarget) headroom: f64,
}

impl Default for Goal {
    fn default() -> Self {
        Self {
            position: DVec3::ZERO,
            rotation: DQuat::IDENTITY,
            pole: DVec3::ZERO,
            extension: 1.0,
            length: 0.0,
            span: 0.0,
            hold: 0.0,
            headroom: f64::INFINITY,
        }
    }
}

/// A joint that a stage changes: its rotation, and its translation where that is said.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::retarget) struct Changed {
    pub(in crate::retarget) joint: usize,
    pub(in crate::retarget) rotates: bool,
    pub(in crate::retarget) moves: bool,
}

/// The new tracks of a joint, where it gets some.
type NewTracks = (Option<Track<Quat>>, Option<Track<Vec3>>);

/// So many of one value. In parallel, because it is the first touch of memory that takes long.
pub(in crate::retarget) fn filled<T: Copy + Send>(value: T, count: usize) -> Vec<T> {
    rayon::iter::repeat_n(value, count).collect()
}

/// What a joint changes to.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::retarget) struct Change {
    pub(in crate::retarget) rotation: Quat,
    pub(in crate::retarget) translation: Vec3,
}

impl Work<'_> {
    /// How the trunk rests on the floor at a frame.
    pub(in crate::retarget) fn resting(&self, frame: usize) -> Resting {
        self.resting.as_ref().and_then(|resting| resting.get(frame)).copied().unwrap_or_default()
    }

    /// The frame of the clip that a frame shows, and its time: schedules and spans of seconds are about the clip.
    pub(in crate::retarget) fn moment(&self, frame: usize) -> Moment {
        let (frame, own) = self.clock.clip_frame(frame);
        Moment { frame, seconds: self.times[own] }
    }

    pub(in crate::retarget) fn frame_count(&self) -> usize {
        self.times.len()
    }

    /// Computes one row per frame in parallel. `init` makes what a thread works in; nothing else is allocated. The result does
    /// not depend on the number of threads, because a row depends on its frame only.
    pub(in crate::retarget) fn rows<T: Copy + Default + Send, S>(
        &self,
        width: usize,
        init: impl Fn() -> S + Sync + Send,
        fill: impl Fn(&mut S, usize, &mut [T]) + Sync + Send,
    ) -> Result<Vec<T>, Canceled> {
        let mut rows = filled(T::default(), self.frame_count() * width);
        self.fill(&mut rows, width, init, fill)?;
        Ok(rows)
    }

    /// The same for rows that are there: `fill` changes what it wants of each.
    pub(in crate::retarget) fn fill<T: Send, S>(
        &self,
        rows: &mut [T],
        width: usize,
        init: impl Fn() -> S + Sync + Send,
        fill: impl Fn(&mut S, usize, &mut [T]) + Sync + Send,
    ) -> Result<(), Canceled> {
        if width == 0 {
            return Ok(());
        }
        rows.par_chunks_mut(CHUNK_FRAMES * width).enumerate().try_for_each_init(init, |scratch, (chunk, rows)| {
            self.control.check()?;
            for (offset, row) in rows.chunks_exact_mut(width).enumerate() {
                fill(scratch, chunk * CHUNK_FRAMES + offset, row);
            }
            Ok(())
        })
    }

    /// [`Self::fill`] for the goals, which the closure gets frame by frame, one per limb of the mapping.
    pub(in crate::retarget) fn change_goals(
        &mut self,
        limb_count: usize,
        change: impl Fn(&Self, usize, &mut [Goal]) + Sync + Send,
    ) -> Result<(), Canceled> {
        let mut goals = std::mem::take(&mut self.goals);
        self.fill(&mut goals, limb_count, || (), |(), frame, goals| change(self, frame, goals))?;
        self.goals = goals;
        Ok(())
    }

    /// Writes rows of changes into the tracks. Rotations are brought onto the hemisphere of the one before.
    pub(in crate::retarget) fn write(&mut self, changed: &[Changed], rows: &[Change]) {
        self.write_columns(changed, |frame, index| &rows[frame * changed.len() + index]);
    }

    /// The same where `change` says what the joint of an index changes to at a frame.
    pub(in crate::retarget) fn write_columns<'a>(
        &mut self,
        changed: &[Changed],
        change: impl Fn(usize, usize) -> &'a Change + Sync,
    ) {
        let (frames, change) = (self.frame_count(), &change);
        let column = |index: usize| (0..frames).map(move |frame| change(frame, index));
        let tracks: Vec<NewTracks> = changed
            .par_iter()
            .enumerate()
            .map(|(index, changed)| {
                let mut before = Quat::IDENTITY;
                let rotations = changed.rotates.then(|| {
                    let together = |change: &Change| {
                        let same = change.rotation.dot(before) >= 0.0;
                        before = if same { change.rotation } else { -change.rotation };
                        before
                    };
                    Track::Sampled(column(index).map(together).collect())
                });
                let moves = || Track::Sampled(column(index).map(|change| change.translation).collect());
                (rotations, changed.moves.then(moves))
            })
            .collect();
        for (changed, (rotation, translation)) in changed.iter().zip(tracks) {
            let joint = &mut self.target[changed.joint];
            if let Some(rotation) = rotation {
                joint.rotation = rotation;
            }
            if let Some(translation) = translation {
                joint.translation = translation;
            }
        }
    }
}
