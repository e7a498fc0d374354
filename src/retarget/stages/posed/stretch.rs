//! A chain whose bones get longer or shorter.

use crate::model::Transform;

use super::figure::Figure;

/// One chain.
#[derive(Clone, Debug)]
pub(super) struct StretchStep {
    /// Slots of the source's chain; empty where its length does not matter.
    pub(super) source: Vec<usize>,
    /// Slots of all joints between the first and the last of the target's chain, and the last: those that are moved.
    pub(super) moved: Vec<usize>,
    /// What a length of the source becomes.
    pub(super) source_scale: f64,
    /// The target's length at rest.
    pub(super) rest_length: f64,
    pub(super) match_source: f64,
    pub(super) scale: f64,
}

impl StretchStep {
    pub(super) fn apply(&self, figure: &mut Figure<'_>) {
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
