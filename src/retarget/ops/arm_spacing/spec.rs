//! `arm_spacing`: arms farther from the body or nearer to it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Turns the upper arms away from the body, about the chest's front: for figures that are wider than the source. The arm below is
/// carried along. Mask: `left_arm`, `right_arm`; default: both.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ArmSpacingOp {
    /// When and on which arms it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Degrees away from the body; less than 0 is toward it. −90 to 90.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub degrees: f64,
}
