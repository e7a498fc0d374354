//! `twist`: twist helpers follow what later ops did to their limb.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Shares the twist of limbs out among the twist joints of the target, from the limbs as the ops before this one left them. The
/// `fk` op does it from the source's motion; put this behind ops that turn hands or feet. Twist counts up to 120° and eases off
/// beyond. Mask: limbs or roles; default: all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct TwistOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Factor on every joint's share. 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub gain: f64,
}

impl Default for TwistOp {
    fn default() -> Self {
        Self { scope: Scope::default(), gain: 1.0 }
    }
}
