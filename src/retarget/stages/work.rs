//! What the stages of one retarget hand on to each other.

use glam::{DQuat, DVec3, Quat, Vec3};
use rayon::prelude::*;

use crate::model::{Canceled, Control, JointTracks, Track};

use super::{contacts::ContactPoints, result::LimitedJoint};

/// Frames that one thread takes at a time.
pub(super) const CHUNK_FRAMES: usize = 64;

/// The state between two stages.
pub(super) struct Work<'a> {
    pub(super) control: &'a Control,
    pub(super) times: &'a [f64],
    /// Tracks of the source, joint by joint.
    pub(super) source: &'a [JointTracks],
    /// Tracks of the target so far.
    pub(super) target: Vec<JointTracks>,
    /// What was found to touch.
    pub(super) contacts: ContactPoints,
    /// Goals frame by frame, one per limb of the mapping; empty before a stage sets some.
    pub(super) goals: Vec<Goal>,
    /// Heights of the source's soles in plan space, frame by frame, one list per limb of the mapping; empty where they are not known yet.
    pub(super) source_soles: Vec<Vec<f64>>,
    /// How far the pelvis is to be moved beside what makes held feet reachable, frame by frame; empty where it is not.
    pub(super) pelvis_moves: Vec<DVec3>,
    /// Distance that is left between goal and end, frame by frame, one per limb; in plan units. Not a number for limbs without goals.
    pub(super) residuals: Vec<f32>,
    /// What `limits` ops took back so far.
    pub(super) limited: Vec<LimitedJoint>,
}

/// Where the end of a limb should be, in plan space.
#[derive(Clone, Copy, Debug)]
pub(super) struct Goal {
    pub(super) position: DVec3,
    pub(super) rotation: DQuat,
    /// Which way the middle joint should point, from the line between start and end; its length is how sure that is, 0 to 1.
    pub(super) pole: DVec3,
    /// The share of its length to which the source's limb is extended.
    pub(super) extension: f64,
    /// How far the limb reaches: the distances from its start to its middle and on to its end.
    pub(super) length: f64,
    /// How far the goal is from the limb's start as the op sets it that gives the limb its goal, before others move it.
    pub(super) span: f64,
    /// How much the goal is one that the foot must not leave, 0 to 1.
    pub(super) hold: f64,
    /// How far it may be lowered before the sole meets the floor, as far as that is known.
    pub(super) headroom: f64,
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
pub(super) struct Changed {
    pub(super) joint: usize,
    pub(super) rotates: bool,
    pub(super) moves: bool,
}

/// The new tracks of a joint, where it gets some.
type NewTracks = (Option<Track<Quat>>, Option<Track<Vec3>>);

/// So many of one value. In parallel, because it is the first touch of memory that takes long.
pub(super) fn filled<T: Copy + Send>(value: T, count: usize) -> Vec<T> {
    rayon::iter::repeat_n(value, count).collect()
}

/// What a joint changes to.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Change {
    pub(super) rotation: Quat,
    pub(super) translation: Vec3,
}

impl Work<'_> {
    pub(super) fn frame_count(&self) -> usize {
        self.times.len()
    }

    /// Computes one row per frame in parallel. `init` makes what a thread works in; nothing else is allocated. The result does
    /// not depend on the number of threads, because a row depends on its frame only.
    pub(super) fn rows<T: Copy + Default + Send, S>(
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
    pub(super) fn fill<T: Send, S>(
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
    pub(super) fn change_goals(
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
    pub(super) fn write(&mut self, changed: &[Changed], rows: &[Change]) {
        self.write_columns(changed, |frame, index| &rows[frame * changed.len() + index]);
    }

    /// The same where `change` says what the joint of an index changes to at a frame.
    pub(super) fn write_columns<'a>(
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
