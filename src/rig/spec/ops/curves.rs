//! Curves of the source's clip: numbers beside its joints that say how much and when.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An alpha that follows a curve of the source's clip: the weight of a morph or an expression. It is the curve times `gain` plus
/// `offset`, within 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlphaCurve {
    /// Its name in the source.
    pub curve: String,
    /// Factor on it. Default: 1.
    #[serde(default = "one")]
    pub gain: f64,
    /// Added to it then. Default: 0.
    #[serde(default)]
    pub offset: f64,
}

/// When a point touches by a curve of the source's clip: while its value is within both bounds. The speed of a foot, baked into a
/// curve, is such a one (`below: 15` where it is in centimetres per second), and so is a switch that is 1 while a foot is locked
/// (`above: 0.5`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactCurve {
    /// Its name in the source.
    pub curve: String,
    /// The point touches below this value only, in the curve's own unit. Default: no such bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub below: Option<f64>,
    /// The point touches above this value only. Default: no such bound; one of the two is needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub above: Option<f64>,
}

const fn one() -> f64 {
    1.0
}
