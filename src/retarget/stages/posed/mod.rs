//! Edits of the target's pose, frame by frame.
//!
//! An op is a list of steps that are done one after the other; what they change below the parents is then blended with the pose
//! before by the op's alpha.

pub(in crate::retarget) mod compile;
pub(in crate::retarget) mod fades;
pub(in crate::retarget) mod figure;

use glam::Quat;

use crate::{
    model::{Canceled, Transform},
    retarget::ops::schedule::Schedule,
};

use self::{fades::FadeStep, figure::Figure};
use super::{
    posing::{Pose, Posing},
    work::{Change, Changed, LimitedJoint, Work},
};
use crate::retarget::ops::{
    arm_spacing::ArmStep,
    fingers::FingerStep,
    fk::{poles::PoleStep, shapes::ShapeStep},
    joints::JointStep,
    limits::LimitStep,
    pin::PinStep,
    props::carried::CarriedStep,
    reach::ReachStep,
    stretch_chain::StretchStep,
    twist::TwistStep,
};

/// Angles by which a joint is turned back that count as limited, degrees; less is rounding.
const LEAST_LIMITED_DEGREES: f64 = 0.05;

/// One op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct PosedStage {
    schedule: Schedule,
    source: Posing,
    target: Posing,
    steps: Vec<Step>,
    /// Whether steps see the alpha themselves, so that their result is taken as it is.
    fades: bool,
    /// The joints that steps change, each once, and their slots.
    changed: Vec<Changed>,
    slots: Vec<usize>,
}

#[derive(Clone, Debug)]
enum Step {
    Joint(Box<JointStep>),
    Pin(Box<PinStep>),
    Copy(CopyStep),
    Add { slot: usize, turn: glam::DQuat },
    Arm(ArmStep),
    Stretch(StretchStep),
    Limit(Box<LimitStep>),
    Twist(TwistStep),
    Finger(FingerStep),
    Carried(CarriedStep),
    Shape(Box<ShapeStep>),
    Pole(PoleStep),
    Reach(Box<ReachStep>),
    Fade(FadeStep),
}

/// A joint that takes a source joint's local transform.
#[derive(Clone, Copy, Debug)]
struct CopyStep {
    source: usize,
    slot: usize,
    /// Target units per source unit; nothing where positions are not copied.
    position: Option<f64>,
    rotation: bool,
}

/// What a thread works in.
struct Scratch {
    source: Pose,
    target: Pose,
    before: Vec<Transform>,
    kept: Vec<Transform>,
}

impl PosedStage {
    pub(in crate::retarget) fn run(&self, work: &mut Work<'_>) -> Result<(), Canceled> {
        let init = || Scratch {
            source: self.source.pose(),
            target: self.target.pose(),
            before: vec![Transform::IDENTITY; self.slots.len()],
            kept: self.target.pose().model,
        };
        let fill = |scratch: &mut Scratch, frame: usize, row: &mut [Change]| {
            self.target.fill(&mut scratch.target, &work.target, frame);
            let alpha = self.schedule.alpha_at(frame, work.times[frame]);
            for (before, &slot) in scratch.before.iter_mut().zip(&self.slots) {
                *before = scratch.target.local[slot];
            }
            if alpha > 0.0 || self.fades {
                self.source.fill(&mut scratch.source, work.source, frame);
                let mut figure = Figure::new(&scratch.source, &self.target, &mut scratch.target, &mut scratch.kept);
                figure.alpha = alpha;
                for step in &self.steps {
                    step.apply(&mut figure);
                }
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
        let rows = work.rows(self.changed.len(), init, fill)?;
        let limited: Vec<LimitedJoint> = self.limited(&rows, work).collect();
        work.limited.extend(limited);
        work.write(&self.changed, &rows);
        Ok(())
    }
}

impl PosedStage {
    /// What limits among the steps take back; the rows are not in the tracks yet.
    fn limited<'a>(&'a self, rows: &'a [Change], work: &'a Work<'_>) -> impl Iterator<Item = LimitedJoint> + 'a {
        let is_limited =
            |slot: &usize| self.steps.iter().any(|step| matches!(step, Step::Limit(limit) if limit.slot == *slot));
        let columns = self.slots.iter().enumerate().filter(move |(_, slot)| is_limited(slot)).map(|(column, _)| column);
        columns.filter_map(move |column| {
            let Changed { joint, .. } = self.changed[column];
            let after = rows.iter().skip(column).step_by(self.changed.len()).map(|change| change.rotation);
            let before = &work.target[joint].rotation;
            let turned = after.enumerate().map(|(frame, after)| {
                let rest = self.target.rest_rotation(joint);
                degrees_between(before.at(frame, rest), after)
            });
            let turned: Vec<f64> = turned.collect();
            let frames = turned.iter().filter(|degrees| **degrees > LEAST_LIMITED_DEGREES).count();
            let (worst_frame, worst_degrees) =
                turned.into_iter().enumerate().max_by(|first, second| first.1.total_cmp(&second.1))?;
            (frames > 0).then_some(LimitedJoint { joint, frames, worst_degrees, worst_frame })
        })
    }
}

/// Exact for small angles too.
fn degrees_between(first: Quat, second: Quat) -> f64 {
    let turn = first.as_dquat().conjugate() * second.as_dquat();
    2.0 * turn.xyz().length().atan2(turn.w.abs()).to_degrees()
}

impl Step {
    fn apply(&self, figure: &mut Figure<'_>) {
        match self {
            Self::Joint(step) => step.apply(figure),
            Self::Pin(step) => step.apply(figure),
            Self::Copy(step) => step.apply(figure),
            Self::Add { slot, turn } => {
                let local = figure.local(*slot);
                figure.set_local(*slot, Transform { rotation: local.rotation * *turn, ..local });
            }
            Self::Arm(step) => step.apply(figure),
            Self::Stretch(step) => step.apply(figure),
            Self::Limit(step) => step.apply(figure),
            Self::Twist(step) => step.apply(figure),
            Self::Finger(step) => step.apply(figure),
            Self::Carried(step) => step.apply(figure),
            Self::Shape(step) => step.apply(figure),
            Self::Pole(step) => step.apply(figure),
            Self::Reach(step) => step.apply(figure),
            Self::Fade(step) => step.apply(figure),
        }
    }
}

impl CopyStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let source = figure.source.local[self.source];
        let mut local = figure.local(self.slot);
        if let Some(unit) = self.position {
            local.translation = source.translation * unit;
        }
        if self.rotation {
            local.rotation = source.rotation;
        }
        figure.set_local(self.slot, local);
    }
}
