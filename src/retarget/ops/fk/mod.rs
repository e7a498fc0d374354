//! Forward kinematics of chains.

pub(in crate::retarget) mod edits;
pub(in crate::retarget) mod poles;
pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod shapes;
pub(in crate::retarget) mod shoulders;
pub(in crate::retarget) mod spec;
pub(in crate::retarget) mod twists;

pub use self::spec::{Carry, FkOp};

use crate::retarget::ops::{
    context::Context,
    fade::Fade,
    op_spec::OpSpec,
    schedule::Schedule,
    scope::{Alpha, Scope},
};

impl OpSpec for FkOp {
    fn scope(&self) -> Option<&Scope> {
        None
    }

    fn alpha(&self) -> &Alpha {
        &self.alpha
    }

    fn looks_at_whole_clip(&self) -> bool {
        self.frames.is_some()
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let schedule = context.fade(&self.alpha, self.frames);
        let edits = edits::resolve(self, context.chains, context.limbs);
        if !edits.is_empty() {
            context.push_front(Schedule::always(), edits);
        }
        let joints = context.chains.iter().flat_map(|chain| chain.target.iter().copied()).collect();
        if let Some(schedule) = schedule.filter(|_| self.enabled) {
            context.push_front(schedule, Fade(joints));
        }
    }
}
