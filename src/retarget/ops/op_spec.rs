//! What the registry asks of the spec of an op.

use super::{Alpha, Scope, context::Context};

/// The fields of an op, as a user writes them.
pub(in crate::retarget) trait OpSpec {
    /// When and on what it works; nothing for `pelvis` and `fk`, which have fields of their own for that.
    fn scope(&self) -> Option<&Scope>;

    /// How much of it is taken.
    fn alpha(&self) -> &Alpha {
        self.scope().map_or(&Alpha::ALL, |scope| &scope.alpha)
    }

    /// Whether it changes poses where it stands among the ops.
    fn changes_poses(&self) -> bool {
        true
    }

    /// Whether what it does in a frame depends on frames far away from it, or on times of the whole clip; its scope aside.
    fn looks_at_whole_clip(&self) -> bool {
        false
    }

    /// Calls `refuse` with each field that is out of range, and why; ranges of the schema are checked already.
    fn check(&self, _refuse: &mut dyn FnMut(&str, String)) {}

    /// Tells of names that mean nothing, also where it is not enabled.
    fn check_names(&self, _context: &mut Context<'_>) {}

    /// Hands what it becomes for two rigs to the context. Called where its scope is enabled.
    fn resolve(&self, context: &mut Context<'_>);
}
