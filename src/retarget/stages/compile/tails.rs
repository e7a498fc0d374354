//! The stage that keeps tails above the floor, from a `floor` op.

use crate::{
    retarget::ops::{FloorOp, resolved::StagedOp},
    rig::Tail,
};

use super::{super::work::Changed, Compiler};
use crate::retarget::ops::floor::tails::{LiftedTail, TailStage};

impl Compiler<'_> {
    /// Nothing where there is no tail, and where the op is about some limbs only.
    pub(in crate::retarget) fn tail_stage(&self, op: &FloorOp, staged: &StagedOp) -> Option<TailStage> {
        let tails = &self.mapping.stages.tails;
        let joints: Vec<usize> = tails.iter().flat_map(|tail| &tail.joints).map(|joint| joint.joint).collect();
        if joints.is_empty() || op.scope.mask.is_some() {
            return None;
        }
        let posing = self.target_posing(joints.iter().copied());
        let lifted = |tail: &Tail| LiftedTail {
            joints: tail.joints.iter().map(|joint| (posing.slot(joint.joint), joint.points.clone())).collect(),
            sunk: tail.sunk,
        };
        Some(TailStage {
            schedule: staged.schedule.clone(),
            tails: tails.iter().map(lifted).collect(),
            ground: self.ground(),
            changed: joints.iter().map(|&joint| Changed { joint, rotates: true, moves: false }).collect(),
            posing,
        })
    }
}
