//! Joints as they are found in a shape.

use glam::DVec2;

use crate::model::Reporter;

/// What to do about joints that were guessed.
pub(super) const CORRECT: &str = "correct char_cfg.yaml, or draw the limbs apart from the body";

/// A joint, in pixels of the shape.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub(super) name: String,
    /// Empty for the root.
    pub(super) parent: String,
    pub(super) place: DVec2,
    /// From 0 to 1.
    pub(super) confidence: f64,
}

impl Joint {
    pub(super) fn new(name: &str, parent: &str, place: DVec2, confidence: f64) -> Self {
        let confidence = confidence.clamp(0.0, 1.0);
        Self { name: name.to_owned(), parent: parent.to_owned(), place, confidence }
    }
}

/// The joints of a body.
#[derive(Debug)]
pub(super) struct Fit {
    /// The root first, each joint after its parent.
    pub(super) joints: Vec<Joint>,
    /// What was guessed.
    pub(super) notes: Reporter,
}

/// Why a shape is no body of a kind.
#[derive(Clone, Debug)]
pub(super) struct NoFit {
    pub(super) detail: String,
}

impl NoFit {
    pub(super) fn new(detail: impl Into<String>) -> Self {
        Self { detail: detail.into() }
    }
}
