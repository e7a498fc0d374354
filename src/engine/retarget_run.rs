//! One run of the algorithm with one spec: resolve, compile, run. The main job does it once, tuning and explaining several times.

use crate::{
    model::{Clip, Control, Reporter},
    retarget::{
        ContactTrack, LimbReach, LimitedJoint, Mapping, Resolved, ResolvedOps, RetargetSpec, RunError, Stack,
        StackResult, resolve,
    },
    rig::{AlignedJoint, Rig},
};

use super::{Failure, FailureCode, files::in_config};

/// What one run gives.
pub(super) struct RetargetRun {
    pub(super) mapping: Mapping,
    pub(super) ops: ResolvedOps,
    /// The spec with everything found out filled in.
    pub(super) resolved: RetargetSpec,
    pub(super) alignment: Vec<AlignedJoint>,
    pub(super) stack: Stack,
    pub(super) result: Clip,
    /// When points of the source touch.
    pub(super) contacts: Vec<ContactTrack>,
    /// How limbs reached their goals.
    pub(super) reaches: Vec<LimbReach>,
    /// What joints were turned back by limits.
    pub(super) limited: Vec<LimitedJoint>,
    /// Compiling and running, nothing else.
    pub(super) seconds: f64,
}

impl RetargetRun {
    /// Resolves a spec and retargets with it. Whoever counts progress enters the phase; frames are counted here.
    pub(super) fn run(
        spec: &RetargetSpec,
        source: &Rig<'_>,
        target: &Rig<'_>,
        clip: &Clip,
        control: &Control,
        reporter: &mut Reporter,
    ) -> Result<Self, Failure> {
        let Resolved { mapping, ops, spec: resolved, alignment } =
            resolve(spec, source, target, clip, reporter).map_err(in_config)?;
        let begin = control.seconds();
        let stack = Stack::new(source.skeleton(), target.skeleton(), &mapping, &ops);
        let StackResult { clip: result, contacts, reaches, limited } = stack.run(clip, control).map_err(run_failure)?;
        let seconds = control.seconds() - begin;
        Ok(Self { mapping, ops, resolved, alignment, stack, result, contacts, reaches, limited, seconds })
    }
}

pub(super) fn run_failure(error: RunError) -> Failure {
    match error {
        RunError::Canceled(canceled) => canceled.into(),
        RunError::OutOfRange(_) => Failure::new(FailureCode::AssetMalformed, error.to_string())
            .in_part("source")
            .with_hint("check the units of both files; distances of the source are beyond any figure's size"),
    }
}
