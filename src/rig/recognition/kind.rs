//! Kinds of bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What kind of body a skeleton is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RigKind {
    /// Two legs, or two arms on a trunk.
    Biped,
    /// Four legs.
    Quadruped,
    /// Anything else: props, single hands, skeletons that say nothing; and creatures on six and more legs.
    #[default]
    Other,
}

impl RigKind {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Biped => "biped",
            Self::Quadruped => "quadruped",
            Self::Other => "other",
        }
    }
}
