//! A constant change of pose.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::AdditivePoseOp;

use crate::model::Transform;
use crate::retarget::stages::posed::{Step, figure::Figure};
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
use glam::DQuat;

/// A joint that is turned by a constant about its own axes.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct AddedTurn {
    /// The joint.
    pub(in crate::retarget) joint: usize,
    /// `L · turn`.
    pub(in crate::retarget) turn: DQuat,
}

/// The same with its slot.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct TurnStep {
    slot: usize,
    turn: DQuat,
}

impl Step for TurnStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let local = figure.local(self.slot);
        figure.set_local(self.slot, Transform { rotation: local.rotation * self.turn, ..local });
    }
}

impl Edit for AddedTurn {
    type Step = TurnStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> TurnStep {
        TurnStep { slot: builder.change(self.joint, true, false), turn: self.turn }
    }
}

impl OpSpec for AdditivePoseOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
