//! `self_contact`: hands that touch the body.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Hands that touch the body, the head, the other arm or each other in the source do so on the target, and do not sink into a
/// thicker body.
///
/// Bodies are capsules and hands are balls, as thick as the mesh around the joints; where there is no mesh, as bodies usually are. While
/// a hand of the source is near a part, the target's is led to the same place along that part, on the same side of it, and as far from its
/// surface (in proportion to how thick both are). Farther away forward kinematics decides. Mask: `left_arm`, `right_arm`; default:
/// both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct SelfContactOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Meters between the surfaces within which a hand begins to follow, at a leg of 1 m. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reach: f64,
    /// Whether hands keep touching what the source's touch.
    pub keep_touch: bool,
    /// Whether hands are kept out of the body, but for as deep as the source's are in theirs.
    pub push_out: bool,
    /// Standard deviation of the smoothing over time of what hands are moved by. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub smoothing_seconds: f64,
}

impl Default for SelfContactOp {
    fn default() -> Self {
        Self { scope: Scope::default(), reach: 0.12, keep_touch: true, push_out: true, smoothing_seconds: 0.1 }
    }
}
