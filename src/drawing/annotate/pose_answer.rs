//! What a pose model answers, and why it does not.

use crate::{drawing::DrawingError, model::Canceled};

/// What a network answers: numbers with their shape.
pub(super) type Answer = (Vec<usize>, Vec<f32>);

/// Why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PoseModelError {
    /// This build has no part that runs models.
    NotBuilt,
    /// The model cannot be used: what is wrong with it.
    Unusable(DrawingError),
    /// Nobody wants it any more.
    Canceled,
}

impl From<Canceled> for PoseModelError {
    fn from(_: Canceled) -> Self {
        Self::Canceled
    }
}

pub(super) fn unusable(detail: impl Into<String>, fix: &str) -> PoseModelError {
    PoseModelError::Unusable(DrawingError::new("pose model", detail, fix))
}
