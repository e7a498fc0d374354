//! Ops that edit poses frame by frame, one joint or chain after the other.

use std::fmt::Debug;

use super::resolved::{OpWork, ResolvedOp};
use crate::retarget::{
    mapping::Mapping,
    stages::{
        builder::StackBuilder,
        posed::{PosedStage, Step, builder::StepBuilder},
    },
};

/// One edit of the target's pose, in joints. Rotations and positions are in plan space where nothing else is said.
pub(in crate::retarget) trait Edit: Debug + Send + Sync {
    /// What works on a frame.
    type Step: Step + 'static;

    /// The target joints that it may turn or move by itself.
    fn joints(&self, mapping: &Mapping) -> Vec<usize>;

    /// The same in slots.
    fn step(&self, builder: &mut StepBuilder<'_>) -> Self::Step;
}

impl<E: Edit> OpWork for Vec<E> {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        let steps = PosedStage::new(stack, &op.schedule, |builder| {
            self.iter().map(|edit| edit.step(builder)).collect::<Vec<E::Step>>()
        });
        stack.push_posed(steps);
    }

    fn changed(&self, _op: &ResolvedOp, mapping: &Mapping) -> Vec<usize> {
        self.iter().flat_map(|edit| edit.joints(mapping)).collect()
    }
}
