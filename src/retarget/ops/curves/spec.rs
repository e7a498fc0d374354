//! Curves of the source's clip: numbers beside its joints, such as custom properties and morph weights. `curves` carries them over,
//! and alphas and contacts may follow them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Carries animated custom properties over into the result, as numbers beside its joints. Faces are the business of `morphs`.
///
/// In a row the value goes through `points` first, then it is multiplied by `gain`, `offset` is added, and it is kept within `clamp`.
/// What no row names keeps its name and its values. With an alpha below 1 a curve goes toward its resting value. Mask: names of
/// the source's curves; default: all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct CurvesOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// What becomes of curves that no row names.
    pub others: OtherCurves,
    /// Rows that say what a curve becomes. Several rows of one source make several curves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<CurveRow>,
}

/// What becomes of curves that no row names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OtherCurves {
    /// They are carried over as they are.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}

/// One row of `curves`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CurveRow {
    /// A custom property or a morph of the source.
    pub source: String,
    /// What it is called in the result. Default: as in the source.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<String>,
    /// Whether it is left out.
    #[serde(default)]
    pub drop: bool,
    /// Pairs of a value and what it becomes, by rising value; straight lines between them, and even beyond both ends. Default:
    /// values stay as they are.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 2]>,
    /// Factor. Default: 1.
    #[serde(default = "one")]
    pub gain: f64,
    /// What is added. Default: 0.
    #[serde(default)]
    pub offset: f64,
    /// Least and most that comes out. Default: no bounds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clamp: Option<[f64; 2]>,
}

/// When a point touches by a curve of the source's clip: while its value is within both bounds. The speed of a foot, baked into a
/// curve, is such a one (`below: 15` where it is in centimeters per second), and so is a switch that is 1 while a foot is locked
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
