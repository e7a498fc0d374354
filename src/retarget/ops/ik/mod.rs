//! Goals for the ends of limbs.

pub(in crate::retarget) mod goals;
pub(in crate::retarget) mod spec;

pub use self::spec::{IkGoal, IkOp};

use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::{Context, Limbs},
        op_spec::OpSpec,
        resolved::{Ahead, OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};

impl OpWork for IkOp {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.set_goals(self, &op.schedule, &op.limbs);
    }

    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        op.limb_joints(mapping, false)
    }

    fn prepare_feet(&self, _op: &ResolvedOp, _stack: &mut StackBuilder<'_>) -> Ahead {
        Ahead::Nothing
    }
}

impl OpSpec for IkOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        context.push_on_limbs(&self.scope, Limbs::Legs, self.clone());
    }
}
