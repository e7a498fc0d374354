//! Ops resolved against two rigs, in indices.

use std::{fmt::Debug, sync::Arc};

use super::{curves::CurveDrive, scale_source::SourceScale, schedule::Schedule};
use crate::{
    model::Reporter,
    retarget::{
        mapping::{LimbPair, Mapping},
        stages::builder::StackBuilder,
    },
};

/// What is done beside the plan.
#[derive(Clone, Debug, Default)]
pub struct ResolvedOps {
    /// The ops behind forward kinematics, in order.
    pub ops: Vec<ResolvedOp>,
    /// What the source's motion is scaled by before anything else.
    pub source_scale: Option<SourceScale>,
    /// What is carried over beside the joints.
    pub curves: Vec<CurveDrive>,
}

impl ResolvedOps {
    /// Whether clips are worked on part by part where they are cut.
    pub(in crate::retarget) fn work_in_parts(&self) -> bool {
        !self.ops.is_empty() && !self.ops.iter().any(|op| op.work.spans_cuts())
    }
}

/// One op behind forward kinematics.
#[derive(Clone, Debug)]
pub struct ResolvedOp {
    name: &'static str,
    pub(in crate::retarget) schedule: Schedule,
    /// Which limbs, as indices into those of the mapping.
    pub(in crate::retarget) limbs: Vec<usize>,
    pub(in crate::retarget) work: Arc<dyn OpWork>,
}

impl ResolvedOp {
    /// `name` is the name on the wire.
    pub(in crate::retarget) fn new(
        name: &'static str,
        schedule: Schedule,
        limbs: Vec<usize>,
        work: impl OpWork + 'static,
    ) -> Self {
        Self { name, schedule, limbs, work: Arc::new(work) }
    }

    /// The name of the op on the wire.
    #[must_use]
    pub const fn name(&self) -> &'static str {
        self.name
    }

    /// Target joints that it may turn or move by itself; what hangs from them follows. The pelvis is among them where the op may
    /// shift it. Joints may repeat.
    #[must_use]
    pub fn changed(&self, mapping: &Mapping) -> Vec<usize> {
        self.work.changed(self, mapping)
    }

    /// The joints of its limbs on the target.
    pub(in crate::retarget) fn limb_joints(&self, mapping: &Mapping, with_ball: bool) -> Vec<usize> {
        let limbs = self.limbs.iter().filter_map(|limb| mapping.limbs.get(*limb));
        limbs.flat_map(|limb| limb.turned(with_ball)).collect()
    }

    /// The pelvis, where the op shifts it for its limbs.
    pub(in crate::retarget) fn shifted(&self, mapping: &Mapping, shifts: bool) -> Option<usize> {
        mapping.pelvis.filter(|_| shifts && !self.limbs.is_empty()).map(|pelvis| pelvis.target)
    }
}

/// What an op does for the feet that one before it holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::retarget) enum Ahead {
    /// They are prepared.
    Prepared,
    /// Nothing; the next one may.
    Nothing,
    /// Feet are where they stay before it runs.
    Ends,
}

/// What an op does, in indices.
pub(in crate::retarget) trait OpWork: Debug + Send + Sync {
    /// Adds its stages to a stack. `following` are the ops behind it.
    fn compile(&self, op: &ResolvedOp, following: &[ResolvedOp], stack: &mut StackBuilder<'_>);

    /// See [`ResolvedOp::changed`].
    fn changed(&self, op: &ResolvedOp, mapping: &Mapping) -> Vec<usize>;

    /// Whether what it does behind a cut of the clip depends on what is before it: a clip is then worked on in one piece.
    fn spans_cuts(&self) -> bool {
        false
    }

    /// Joints that it fades toward their rest pose.
    fn faded(&self) -> &[usize] {
        &[]
    }

    /// Prepares feet that an op before it is about to hold.
    fn prepare_feet(&self, _op: &ResolvedOp, _stack: &mut StackBuilder<'_>) -> Ahead {
        Ahead::Ends
    }

    /// Warns of what the op cannot do; `before` are the ops before it.
    fn report(&self, _op: &ResolvedOp, _before: &[ResolvedOp], _limbs: &[LimbPair], _reporter: &mut Reporter) {}
}
