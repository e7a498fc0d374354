//! Which chain drives which, and how.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A source chain that drives a target chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChainMap {
    /// A name from `source.chains`, or a role such as `left_forearm`, `left_arm`, `spine`.
    pub source: String,
    /// A name from `target.chains`, or a role.
    pub target: String,
    /// How rotations are found. Default: what the `fk` op says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationMode>,
    /// How translations are found. Default: what the `fk` op says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub translation: Option<TranslationMode>,
    /// 0 keeps the rest rotation, 1 takes the source's; beyond 1 exaggerates. −10 to 10. Default: what the `fk` op says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -10.0, max = 10.0))]
    pub rotation_alpha: Option<f64>,
    /// 0 keeps the rest translation, 1 takes the translation mode's. −10 to 10. Default: what the `fk` op says.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -10.0, max = 10.0))]
    pub translation_alpha: Option<f64>,
}

/// How the rotations of a target chain follow from a source chain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RotationMode {
    /// `one_to_one` where both chains have the same number of joints, else `interpolated`.
    #[default]
    Auto,
    /// The chain stays at rest relative to its parent.
    None,
    /// At equal normalised arc length along the rest chains, between the two nearest source joints.
    Interpolated,
    /// Joint k follows joint k from the chain's start; surplus target joints keep their rest.
    OneToOne,
    /// The same, counted from the chain's end.
    OneToOneReversed,
}

/// How the translations of a target chain follow from a source chain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TranslationMode {
    /// Bones keep the target's length.
    #[default]
    None,
    /// The source joint's offset from its parent, times the pelvis height ratio.
    GloballyScaled,
    /// The joint goes where the source joint is.
    Absolute,
}
