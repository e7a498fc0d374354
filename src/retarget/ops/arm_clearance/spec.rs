//! `arm_clearance`: arms beside a body that is thicker.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Swings arms about their shoulders out of a trunk, a head or thighs that are thicker than the source's, to the side on which the source's
/// arms are. Elbows keep their bend and hands how they are turned.
///
/// Bodies are capsules that are as wide and as deep as the mesh. Arms may be in them as deep as the source's are, and by `depth` more. Mask:
/// `left_arm`, `right_arm`; default: both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ArmClearanceOp {
    /// When and on which arms it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Meters by which arms may be deeper in the body than the source's, at a leg of 1 m: capsules are about as thick as bodies are. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub depth: f64,
    /// By how much an arm is swung at most. 0 to 90 degrees.
    #[schemars(range(min = 0.0, max = 90.0))]
    pub max_degrees: f64,
    /// Standard deviation of the smoothing over time of what arms are swung by. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub smoothing_seconds: f64,
}

impl Default for ArmClearanceOp {
    fn default() -> Self {
        Self { scope: Scope::default(), depth: 0.03, max_degrees: 45.0, smoothing_seconds: 0.1 }
    }
}
