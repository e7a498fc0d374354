//! `hand_contact`: hands that touch each other.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Hands that are held together, folded or clapped in the source meet on the target, whatever the length of its arms and the width of its
/// shoulders.
///
/// While the palms of the source are near each other, those of the target are led to the same distance and direction from each other, half of
/// the way each; distances between palms scale with how thick the hands are. Elbows bend, hands keep how they are turned. Both arms have to be
/// mapped; a mask that leaves one out keeps that one where it is, and the other goes all the way. Mask: `left_arm`, `right_arm`; default: both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct HandContactOp {
    /// When and on which arms it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Meters between the source's hands beyond which the target's are left alone, at a leg of 1 m. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reach: f64,
    /// Standard deviation of the smoothing over time of what hands are moved by. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub smoothing_seconds: f64,
}

impl Default for HandContactOp {
    fn default() -> Self {
        Self { scope: Scope::default(), reach: 0.3, smoothing_seconds: 0.1 }
    }
}
