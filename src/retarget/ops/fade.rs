//! Forward kinematics that are faded out toward the rest pose.

use crate::model::Transform;
use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::resolved::{OpWork, ResolvedOp},
    spec::TranslationMode,
    stages::{
        builder::StackBuilder,
        posed::{
            PosedStage,
            builder::StepBuilder,
            figure::{Figure, scaled},
        },
    },
};

/// The joints of an op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct FadeStep {
    pub(in crate::retarget) joints: Vec<FadedJoint>,
    /// Their slots, and those of `below`.
    pub(in crate::retarget) slots: Vec<usize>,
    /// Driven joints below, which keep how they are turned.
    pub(in crate::retarget) below: Vec<usize>,
}

/// One joint; parents come before their children.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct FadedJoint {
    pub(in crate::retarget) slot: usize,
    /// Where it is at an alpha of 0, below its parent.
    pub(in crate::retarget) rest: Transform,
    /// Whether its change is measured in the model, and not below its parent.
    pub(in crate::retarget) in_model: bool,
    /// Whether its position fades too.
    pub(in crate::retarget) moves: bool,
}

impl Step for FadeStep {
    /// The same as a constant alpha of forward kinematics: `L_T = L_T^R · ((L_T^R)⁻¹ · P_T⁻¹ · G_T)^alpha`, with `P_T` faded already.
    fn apply(&self, figure: &mut Figure<'_>) {
        let alpha = figure.alpha;
        figure.keep(&self.slots);
        for joint in &self.joints {
            if joint.in_model {
                let kept = figure.kept(joint.slot).rotation;
                figure.turn_to(joint.slot, kept);
            }
            let local = figure.local(joint.slot);
            let change = (joint.rest.rotation.conjugate() * local.rotation).normalize();
            let rotation = (joint.rest.rotation * scaled(change, alpha)).normalize();
            let translation =
                if joint.moves { joint.rest.translation.lerp(local.translation, alpha) } else { local.translation };
            figure.set_local(joint.slot, Transform { rotation, translation, ..local });
        }
        figure.turn_back(&self.below);
    }
}

/// The joints that a `pelvis` or `fk` op fades behind the plan.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Fade(pub(in crate::retarget) Vec<usize>);

impl OpWork for Fade {
    fn compile(&self, op: &ResolvedOp, _following: &[ResolvedOp], stack: &mut StackBuilder<'_>) {
        if self.0.is_empty() {
            return;
        }
        let stage = PosedStage::new(stack, &op.schedule, |builder| vec![step(builder, &self.0)]);
        stack.push_posed(stage.map(|stage| PosedStage { fades: true, ..stage }));
    }

    /// What is faded is changed by other ops.
    fn changed(&self, _op: &ResolvedOp, _mapping: &Mapping) -> Vec<usize> {
        Vec::new()
    }

    fn faded(&self) -> &[usize] {
        &self.0
    }
}

fn step(builder: &mut StepBuilder<'_>, joints: &[usize]) -> FadeStep {
    let stack = builder.stack;
    let mapping = stack.mapping;
    let is_pelvis = |joint: usize| mapping.pelvis.is_some_and(|pelvis| pelvis.target == joint);
    let twisted = |joint: usize| mapping.twists.iter().any(|twist| twist.joint == joint && twist.segment != joint);
    let is_lifted = |joint: usize| mapping.shoulders.iter().any(|shoulder| shoulder.joint == joint);
    // What follows these joints fades with them.
    let twists = mapping.twists.iter().filter(|twist| joints.contains(&twist.segment)).map(|twist| twist.joint);
    let lifted = mapping.shoulders.iter().filter(|pair| joints.contains(&pair.upper_arm)).map(|pair| pair.joint);
    let mut all: Vec<usize> = joints.iter().copied().chain(twists).chain(lifted).collect();
    all.sort_unstable();
    all.dedup();
    let below: Vec<usize> = all
        .iter()
        .flat_map(|&joint| stack.topmost_driven_below(Some(joint)))
        .filter(|joint| !all.contains(joint))
        .collect();
    let faded: Vec<FadedJoint> = all
        .iter()
        .map(|&joint| {
            let rest = builder.rest_below_parent(joint);
            let hold = mapping.target_hold.transforms()[joint];
            let moves = is_pelvis(joint)
                || mapping
                    .chains
                    .iter()
                    .any(|chain| chain.target.contains(&joint) && chain.drive.translation != TranslationMode::None);
            FadedJoint {
                slot: builder.change(joint, true, moves),
                rest: if is_pelvis(joint) { rest } else { Transform { rotation: rest.rotation, ..hold } },
                in_model: !twisted(joint) && !is_lifted(joint),
                moves,
            }
        })
        .collect();
    let below: Vec<usize> = below.into_iter().map(|joint| builder.change(joint, true, false)).collect();
    let slots = faded.iter().map(|joint| joint.slot).chain(below.iter().copied()).collect();
    FadeStep { joints: faded, slots, below }
}
