//! A chain whose bones get longer or shorter.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::StretchChainOp;

use crate::model::Transform;

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

impl StretchStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
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
