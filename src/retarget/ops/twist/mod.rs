//! A twist joint that takes its share of what its limb is twisted by. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod spec;

pub use self::spec::TwistOp;

use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{
        context::Context,
        op_spec::OpSpec,
        resolved::{OpWork, ResolvedOp},
        scope::Scope,
    },
    stages::builder::StackBuilder,
};
use crate::retarget::{
    mapping::{TwistAgainst, TwistPair},
    stages::posed::{PosedStage, builder::StepBuilder},
};
use glam::{DQuat, DVec3};

use crate::model::rotation::{shared_twist, twist_angle};

use crate::retarget::stages::posed::figure::Figure;

/// One joint beside its limb's bone.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct TwistStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) segment: usize,
    pub(in crate::retarget) against: Against,
    /// Along the limb, in the segment's own axes.
    pub(in crate::retarget) axis: DVec3,
    pub(in crate::retarget) segment_from_joint: DQuat,
    pub(in crate::retarget) share: f64,
    /// Joints below that stay where they are: the hand below a joint that splits the forearm.
    pub(in crate::retarget) left_behind: Vec<usize>,
}

/// Where the twist is seen.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) enum Against {
    /// Against what carries the limb; `carrier_from_segment` at rest.
    Carrier { slot: usize, carrier_from_segment: DQuat },
    /// Against what it leads to; `segment_from_end` at rest.
    End { slot: usize, segment_from_end: DQuat },
}

impl Step for TwistStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let segment = figure.model(self.segment).rotation;
        let change = match self.against {
            Against::Carrier { slot, carrier_from_segment } => {
                carrier_from_segment.conjugate() * figure.model(slot).rotation.conjugate() * segment
            }
            Against::End { slot, segment_from_end } => {
                segment.conjugate() * figure.model(slot).rotation * segment_from_end.conjugate()
            }
        };
        let turn = DQuat::from_axis_angle(self.axis, shared_twist(twist_angle(change, self.axis)) * self.share);
        figure.keep(&self.left_behind);
        figure.turn_to(self.slot, segment * turn * self.segment_from_joint);
        figure.put_back(&self.left_behind);
    }
}

/// A `twist` op: its gain, and the segments and joints that it is about.
#[derive(Clone, Debug)]
struct ResolvedTwist {
    gain: f64,
    masked: Vec<usize>,
}

impl OpWork for ResolvedTwist {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        stack.close();
        // A joint that is its own segment is turned by the source's motion alone.
        let is_wanted = |pair: &&TwistPair| {
            pair.segment != pair.joint && (self.masked.contains(&pair.segment) || self.masked.contains(&pair.joint))
        };
        let mut pairs: Vec<TwistPair> = stack.mapping.twists.iter().filter(is_wanted).copied().collect();
        pairs.sort_by_key(|pair| pair.joint);
        let steps = PosedStage::new(stack, &op.schedule, |builder| {
            pairs.iter().map(|pair| step(builder, pair, self.gain)).collect::<Vec<TwistStep>>()
        });
        stack.push_posed(steps);
    }

    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        self.masked.clone()
    }
}

fn step(builder: &mut StepBuilder<'_>, pair: &TwistPair, gain: f64) -> TwistStep {
    let against = match pair.against {
        TwistAgainst::Carrier { joint, carrier_from_segment } => {
            Against::Carrier { slot: builder.target(joint), carrier_from_segment }
        }
        TwistAgainst::End { joint, segment_from_end } => Against::End { slot: builder.target(joint), segment_from_end },
    };
    let left_behind = builder.driven_below(pair.joint);
    TwistStep {
        slot: builder.change(pair.joint, true, false),
        segment: builder.target(pair.segment),
        against,
        axis: pair.axis,
        segment_from_joint: pair.segment_from_joint,
        share: pair.share * gain,
        left_behind,
    }
}

impl OpSpec for TwistOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let masked = context.masked(&self.scope);
        let masked = masked.unwrap_or_else(|| (0..context.target.skeleton().len()).collect());
        context.push(&self.scope, ResolvedTwist { gain: self.gain, masked });
    }
}
