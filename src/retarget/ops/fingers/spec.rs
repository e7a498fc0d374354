//! `fingers`: hands that close more or less.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Multiplies how much fingers are bent and spread since the rest pose, on top of what the ops before gave. Bending is about the
/// line of the knuckles; spreading is counted at the first joints only. Thumbs are bent as a whole. Mask: fingers or hands;
/// default: all fingers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FingersOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Factor on the bending. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub curl: f64,
    /// Factor on the spreading. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub spread: f64,
    /// Degrees that every joint is bent further, toward the palm. −180 to 180.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub curl_offset: f64,
}

impl Default for FingersOp {
    fn default() -> Self {
        Self { scope: Scope::default(), curl: 1.0, spread: 1.0, curl_offset: 0.0 }
    }
}
