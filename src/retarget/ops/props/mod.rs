//! Things in hands.

pub(in crate::retarget) mod carried;
pub(in crate::retarget) mod grips;
pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{CarriedProp, Grip, GripHand, PropsOp};

use crate::retarget::ops::{context::Context, op_spec::OpSpec, resolved::ResolvedOp, scope::Scope};
use grips::Grips;

impl OpSpec for PropsOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let grips = resolve::grips(self, context);
        let props = resolve::resolve(self, context);
        let schedule = context.schedule(&self.scope);
        if !grips.is_empty() {
            context.resolved.ops.push(ResolvedOp::new(context.name, schedule.clone(), Vec::new(), Grips(grips)));
        }
        context.resolved.ops.push(ResolvedOp::new(context.name, schedule, Vec::new(), props));
    }
}
