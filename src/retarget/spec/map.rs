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
    /// Further source chains; the target chain follows the mean of all, as a finger does that stands for several. Chains of one
    /// name only, no limbs; not where `carry` is `parent`. At most 8.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 8))]
    pub also: Vec<String>,
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
    /// At equal normalized arc length along the rest chains, between the two nearest source joints.
    Interpolated,
    /// Joint k follows joint k from the chain's start; surplus target joints keep their rest.
    OneToOne,
    /// The same, counted from the chain's end.
    OneToOneReversed,
    /// As `interpolated`, then bones are turned until the target's joints lie on the line of the source's chain, laid to the
    /// target's start; each as far along it as its bone is long. A limb is one chain.
    MatchChain,
    /// The same with the source's line scaled to the target's length, so that the whole shape fits.
    MatchScaledChain,
    /// The source joint's rotation below its parent, as it is: for rigs whose joints have the same axes.
    CopyLocal,
}

impl RotationMode {
    /// Whether it changes what forward kinematics give, instead of deciding what they follow.
    #[must_use]
    pub const fn is_shape(self) -> bool {
        matches!(self, Self::MatchChain | Self::MatchScaledChain | Self::CopyLocal)
    }
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
    /// All bones of the chain get longer or shorter as the source's chain as a whole does since its rest pose. A limb is one chain.
    StretchUniform,
    /// Each bone gets longer or shorter as the source's chain does at the same place.
    StretchBySegment,
    /// The bone is turned and stretched below its parent as the source's has been since its rest pose:
    /// `o_T = |o_S| / |o_S^R| · arc(o_S^R → o_S) · o_T^R`.
    OrientAndScale,
}

impl TranslationMode {
    /// Whether it changes what forward kinematics give.
    #[must_use]
    pub const fn is_shape(self) -> bool {
        matches!(self, Self::StretchUniform | Self::StretchBySegment | Self::OrientAndScale)
    }
}
