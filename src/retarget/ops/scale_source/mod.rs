//! A larger or smaller source.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;
pub(in crate::retarget) mod stage;

pub use self::spec::ScaleSourceOp;
pub(in crate::retarget) use self::stage::ScaledSource;
pub use self::stage::SourceScale;

use crate::retarget::ops::{context::Context, op_spec::OpSpec, scope::Scope};

impl OpSpec for ScaleSourceOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn changes_poses(&self) -> bool {
        false
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let before = context.resolved.source_scale;
        context.resolved.source_scale = resolve::resolve(self, context.index, context.source, before, context.fields);
    }
}
