//! An upper arm that is turned away from the body.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::ArmSpacingOp;

use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
use glam::{DQuat, DVec3};

use crate::retarget::stages::posed::figure::Figure;

/// One arm.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct ArmStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) chest: usize,
    /// The figure's front in the chest's own axes.
    pub(in crate::retarget) front: DVec3,
    pub(in crate::retarget) radians: f64,
}

impl Step for ArmStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let front = (figure.model(self.chest).rotation * self.front).normalize_or(DVec3::Z);
        let now = figure.model(self.slot).rotation;
        figure.turn_to(self.slot, DQuat::from_axis_angle(front, self.radians) * now);
    }
}

/// An upper arm that is turned away from the body.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct SpacedArm {
    /// The upper arm.
    pub(in crate::retarget) joint: usize,
    /// The joint that it hangs from on the body.
    pub(in crate::retarget) chest: usize,
    /// About the chest's front.
    pub(in crate::retarget) radians: f64,
}

impl Edit for SpacedArm {
    type Step = ArmStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> ArmStep {
        let Self { joint, chest, radians } = *self;
        let front = builder.stack.target_rest[chest].rotation.conjugate() * builder.stack.ground().front;
        let slot = builder.change(joint, true, false);
        ArmStep { slot, chest: builder.target(chest), front, radians }
    }
}

impl OpSpec for ArmSpacingOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
