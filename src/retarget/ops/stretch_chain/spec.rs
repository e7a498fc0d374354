//! `stretch_chain`: chains that are made longer or shorter.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Multiplies the lengths of the bones of a chain: `factor = scale · lerp(1, length_S / length_T, match_source)`. The length of
/// the source is the one that its chain has at that frame, times the pelvis scale. Mask: chains, roles or limbs; without one
/// nothing is stretched.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct StretchChainOp {
    /// When and on which chains it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// How much chains become as long as the source's. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub match_source: f64,
    /// Factor on the length. 0.01 to 100.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub scale: f64,
}

impl Default for StretchChainOp {
    fn default() -> Self {
        Self { scope: Scope::default(), match_source: 0.0, scale: 1.0 }
    }
}
