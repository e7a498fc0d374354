//! A chain whose bones get longer or shorter.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::StretchChainOp;

use crate::model::Transform;
use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};

use crate::retarget::stages::posed::figure::Figure;

/// One chain.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct StretchStep {
    /// Slots of the source's chain; empty where its length does not matter.
    pub(in crate::retarget) source: Vec<usize>,
    /// Slots of all joints between the first and the last of the target's chain, and the last: those that are moved.
    pub(in crate::retarget) moved: Vec<usize>,
    /// What a length of the source becomes.
    pub(in crate::retarget) source_scale: f64,
    /// The target's length at rest.
    pub(in crate::retarget) rest_length: f64,
    pub(in crate::retarget) match_source: f64,
    pub(in crate::retarget) scale: f64,
}

impl Step for StretchStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let place = |slot: usize| figure.source.model[slot].translation;
        let length: f64 = self.source.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum();
        let ratio =
            if self.rest_length > 0.0 && length > 0.0 { length * self.source_scale / self.rest_length } else { 1.0 };
        let factor = self.scale * (1.0 + (ratio - 1.0) * self.match_source);
        for &slot in &self.moved {
            let local = figure.local(slot);
            figure.set_local(slot, Transform { translation: local.translation * factor, ..local });
        }
    }
}

/// How a chain is stretched.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct ChainStretch {
    /// Joints of the source, from the body outward, for its length; may be empty.
    pub(in crate::retarget) source: Vec<usize>,
    /// Joints of the target; the bones between them are stretched.
    pub(in crate::retarget) target: Vec<usize>,
    /// Share of becoming as long as the source's.
    pub(in crate::retarget) match_source: f64,
    /// Factor.
    pub(in crate::retarget) scale: f64,
}

impl Edit for ChainStretch {
    type Step = StretchStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        self.target.clone()
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> StretchStep {
        let stack = builder.stack;
        let (first, last) = (self.target[0], self.target[self.target.len() - 1]);
        // Joints of a chain may hang one below the other with others between, or not at all.
        let on_the_way = stack.target.path(first, last).unwrap_or_else(|| self.target.clone());
        let place = |joint: usize| stack.target_rest[joint].translation;
        let rest_length = on_the_way.windows(2).map(|pair| place(pair[0]).distance(place(pair[1]))).sum();
        StretchStep {
            source: self.source.iter().map(|&joint| builder.source(joint)).collect(),
            moved: on_the_way[1..].iter().map(|&joint| builder.change(joint, false, true)).collect(),
            source_scale: stack.mapping.global_scale,
            rest_length,
            match_source: self.match_source,
            scale: self.scale,
        }
    }
}

impl OpSpec for StretchChainOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
