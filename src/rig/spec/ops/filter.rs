//! `filter`: takes noise off rotations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scope;

/// Takes noise off the local rotations of the target's driven joints. Mask: roles or limbs; default: all but the legs, whose feet
/// would leave their places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FilterOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// The kind of filter.
    pub kind: FilterKind,
    /// `bell`: its standard deviation. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub seconds: f64,
    /// `one_euro`: what is let through while a joint rests. 0.01 to 100 Hz.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub min_frequency: f64,
    /// `one_euro`: how many Hz more for each radian per second. 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub responsiveness: f64,
}

impl Default for FilterOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            kind: FilterKind::default(),
            seconds: 0.03,
            min_frequency: 2.0,
            responsiveness: 0.5,
        }
    }
}

/// A kind of filter. None delays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterKind {
    /// A mean over time under a bell curve.
    #[default]
    Bell,
    /// The One-Euro filter, forward and backward: the slower a joint, the more is taken off.
    OneEuro,
}
