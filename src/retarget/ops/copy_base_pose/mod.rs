//! Joints that take the local transform of their namesakes in the source.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::CopyBasePoseOp;

use crate::retarget::stages::posed::{Step, figure::Figure};
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};

/// A joint that takes a source joint's local transform.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct CopyStep {
    source: usize,
    slot: usize,
    /// Target units per source unit; nothing where positions are not copied.
    position: Option<f64>,
    rotation: bool,
}

impl Step for CopyStep {
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

/// What is copied from a source joint.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct CopyDrive {
    /// Joint of the source.
    pub(in crate::retarget) source: usize,
    /// Joint of the target.
    pub(in crate::retarget) joint: usize,
    /// Whether the position is.
    pub(in crate::retarget) position: bool,
    /// Whether the rotation is.
    pub(in crate::retarget) rotation: bool,
}

impl Edit for CopyDrive {
    type Step = CopyStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> CopyStep {
        CopyStep {
            source: builder.source(self.source),
            slot: builder.change(self.joint, self.rotation, self.position),
            position: self.position.then_some(builder.stack.mapping.plan_from_source.scale.x),
            rotation: self.rotation,
        }
    }
}

impl OpSpec for CopyBasePoseOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
