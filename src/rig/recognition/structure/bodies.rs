//! Bodies on two legs and on four, as they are found.

use glam::DVec3;

use super::{limb::Segments, twins::Pair};

/// An upright body.
#[derive(Clone, Debug)]
pub(super) struct Upright {
    pub legs: Limbs,
    pub arms: Limbs,
    /// Legs and spine hang from it.
    pub pelvis: usize,
    /// From the hips to the shoulders; not of unit length.
    pub trunk: DVec3,
    /// From 0 to 1.
    pub score: f64,
}

/// A pair of limbs with its joints found.
#[derive(Clone, Debug)]
pub(super) struct Limbs {
    pub pair: Pair,
    pub best: Segments,
    pub second: Option<Segments>,
}

impl Limbs {
    /// Whether something lies behind the joint after the end: behind the ball of a foot.
    pub(super) fn has_tips(&self) -> bool {
        self.pair.ways[0].len() > self.best.end + 2
    }
}

/// A body on four legs.
#[derive(Clone, Debug)]
pub(super) struct Level {
    pub hind: Pair,
    pub front: Pair,
    pub pelvis: usize,
    /// Where the legs point.
    pub down: DVec3,
    /// From the hind legs to the front legs; not of unit length.
    pub trunk: DVec3,
    /// From 0 to 1.
    pub score: f64,
}

/// A step from 0 at `low` to 1 at `high`.
pub(super) fn step(value: f64, low: f64, high: f64) -> f64 {
    ((value - low) / (high - low)).clamp(0.0, 1.0)
}
