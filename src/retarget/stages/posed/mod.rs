//! Edits of the target's pose, frame by frame.
//!
//! An op is a list of steps that are done one after the other; what they change below the parents is then blended with the pose
//! before by the op's alpha.

pub(in crate::retarget) mod builder;
pub(in crate::retarget) mod figure;

use std::fmt::Debug;

use super::{
    posing::{Pose, Posing},
    stage::Stage,
    work::{Change, Changed, Work},
};
use crate::{
    model::{Canceled, Transform},
    retarget::ops::schedule::Schedule,
};
use figure::Figure;

/// An edit of the pose of one frame.
pub(in crate::retarget) trait Step: Debug + Send + Sync {
    /// Changes the target's pose.
    fn apply(&self, figure: &mut Figure<'_>);
}

/// The steps of an op, which are all of one kind: one call a frame finds out which.
pub(in crate::retarget) trait Steps: Debug + Send + Sync {
    /// Applies one after the other.
    fn apply(&self, figure: &mut Figure<'_>);
}

impl<S: Step> Steps for Vec<S> {
    fn apply(&self, figure: &mut Figure<'_>) {
        for step in self {
            step.apply(figure);
        }
    }
}

/// One op.
#[derive(Debug)]
pub(in crate::retarget) struct PosedStage {
    pub(in crate::retarget) schedule: Schedule,
    pub(in crate::retarget) source: Posing,
    pub(in crate::retarget) target: Posing,
    pub(in crate::retarget) steps: Box<dyn Steps>,
    /// Whether steps see the alpha themselves, so that their result is taken as it is.
    pub(in crate::retarget) fades: bool,
    /// The joints that steps change, each once, and their slots.
    pub(in crate::retarget) changed: Vec<Changed>,
    pub(in crate::retarget) slots: Vec<usize>,
}

/// What a thread works in.
struct Scratch {
    source: Pose,
    target: Pose,
    before: Vec<Transform>,
    kept: Vec<Transform>,
}

impl PosedStage {
    /// What its joints change to, frame by frame.
    pub(in crate::retarget) fn rows(&self, work: &Work<'_>) -> Result<Vec<Change>, Canceled> {
        let init = || Scratch {
            source: self.source.pose(),
            target: self.target.pose(),
            before: vec![Transform::IDENTITY; self.slots.len()],
            kept: self.target.pose().model,
        };
        let fill = |scratch: &mut Scratch, frame: usize, row: &mut [Change]| {
            self.target.fill(&mut scratch.target, &work.target, frame);
            let alpha = self.schedule.alpha_at(work.moment(frame));
            for (before, &slot) in scratch.before.iter_mut().zip(&self.slots) {
                *before = scratch.target.local[slot];
            }
            if alpha > 0.0 || self.fades {
                self.source.fill(&mut scratch.source, work.source, frame);
                let mut figure = Figure::new(&scratch.source, &self.target, &mut scratch.target, &mut scratch.kept);
                figure.alpha = alpha;
                self.steps.apply(&mut figure);
            }
            for ((change, before), &slot) in row.iter_mut().zip(&scratch.before).zip(&self.slots) {
                let after = scratch.target.local[slot];
                let (rotation, translation) = if alpha < 1.0 && !self.fades {
                    let rotation = before.rotation.slerp(after.rotation, alpha);
                    (rotation, before.translation.lerp(after.translation, alpha))
                } else {
                    (after.rotation, after.translation)
                };
                *change = Change { rotation: rotation.normalize().as_quat(), translation: translation.as_vec3() };
            }
        };
        work.rows(self.changed.len(), init, fill)
    }
}

impl Stage for PosedStage {
    fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let rows = self.rows(work)?;
        work.write(&self.changed, &rows);
        Ok(())
    }
}
