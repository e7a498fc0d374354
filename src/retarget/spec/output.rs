//! What comes out.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

use crate::{picture::View, rig::deserialize::one_or_several};

/// One output or several.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum OutputChoice {
    /// One.
    One(OutputSpec),
    /// Several; at most 8.
    Many(Vec<OutputSpec>),
}

impl<'de> Deserialize<'de> for OutputChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        one_or_several(deserializer, "an output or a list of outputs", Self::One, Self::Many)
    }
}

/// One output.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Wire name of the format, such as `glb`, `fbx`, `bvh`, `vrma`, `poses_npz`; see `/v1/formats`.
    pub format: Option<String>,
    /// How much of the target goes into it.
    pub include: IncludeSpec,
    /// What happens to the clips that the target has already; the new one is always the first.
    pub target_clips: TargetClipsSpec,
    /// Name of the new clip. Default: the source clip's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_name: Option<String>,
    /// Which keys are written. Formats whose tracks all have the same key times hold every frame; a warning says so.
    #[serde(skip_serializing_if = "KeysSpec::is_all")]
    pub keys: KeysSpec,
    /// In which order a BVH or FBX has the rotations of its joints. FBX itself names them from the other end: `zyx` is its XYZ.
    #[serde(skip_serializing_if = "RotationOrder::is_auto")]
    pub rotation_order: RotationOrder,
    /// How glTF formats store the animation.
    #[serde(skip_serializing_if = "CompressionSpec::is_none")]
    pub compression: CompressionSpec,
    /// How pictures (`png`, `webp`, `gif`, `apng`, `mp4`) show the result. Without it, as `retargetd preview` does.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view: Option<View>,
}

/// How glTF formats store the numbers of an animation.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum CompressionSpec {
    /// As floats.
    #[default]
    None,
    /// Rotations in 16 bits a component, every joint within 0.01 degrees in the world. Every reader of glTF knows it.
    Quantized,
    /// `EXT_meshopt_compression`: rotations likewise, translations and scales to a millionth, and all of it packed. Readers need the
    /// extension.
    Meshopt,
}

impl CompressionSpec {
    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
    fn is_none(&self) -> bool {
        *self == Self::None
    }
}

/// In which order rotations about three axes are written; the first one named is applied last, as BVH channels are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RotationOrder {
    /// `zxy` in a BVH, `zyx` in an FBX; for joints that come near its gimbal, or whose angles turn faster than they do, the order whose
    /// angles change least from frame to frame, with a warning.
    #[default]
    Auto,
    /// X, Y, Z.
    Xyz,
    /// X, Z, Y.
    Xzy,
    /// Y, X, Z.
    Yxz,
    /// Y, Z, X.
    Yzx,
    /// Z, X, Y: what motion capture files use most.
    Zxy,
    /// Z, Y, X.
    Zyx,
}

impl RotationOrder {
    /// The names of the axes; nothing where each joint is to have its own.
    #[must_use]
    pub const fn name(self) -> Option<&'static str> {
        match self {
            Self::Auto => None,
            Self::Xyz => Some("xyz"),
            Self::Xzy => Some("xzy"),
            Self::Yxz => Some("yxz"),
            Self::Yzx => Some("yzx"),
            Self::Zxy => Some("zxy"),
            Self::Zyx => Some("zyx"),
        }
    }

    #[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
    fn is_auto(&self) -> bool {
        *self == Self::Auto
    }
}

/// Which keys are written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"all\", \"needed\" or an object")]
pub enum KeysSpec {
    /// A word.
    Word(KeysWord),
    /// Those that are needed, with these tolerances.
    Needed(KeyTolerance),
}

/// Which keys are written, in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KeysWord {
    /// One per frame.
    All,
    /// Those that interpolation does not give back, with the default tolerances.
    Needed,
}

/// How much may be lost where keys are left out.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct KeyTolerance {
    /// The most that a point of the mesh may move; where a joint is known to touch something, a quarter of it. Meters, 0.000001 to 1.
    #[schemars(range(min = 0.000_001, max = 1.0))]
    pub distance_meters: f64,
    /// How far from a joint its mesh reaches. Meters, 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub shell_meters: f64,
    /// What may lie between keys.
    pub interpolation: KeyInterpolation,
}

/// What lies between keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KeyInterpolation {
    /// For each track what takes less room.
    #[default]
    Auto,
    /// The straight way, of rotations the shortest arc: what every reader knows.
    Linear,
    /// A cubic with tangents (`CUBICSPLINE` of glTF).
    Cubic,
}

impl Default for KeyTolerance {
    fn default() -> Self {
        Self { distance_meters: 0.0005, shell_meters: 0.1, interpolation: KeyInterpolation::Auto }
    }
}

impl Default for KeysSpec {
    fn default() -> Self {
        Self::Word(KeysWord::All)
    }
}

impl KeysSpec {
    /// Whether every key is written.
    #[must_use]
    pub const fn is_all(&self) -> bool {
        matches!(self, Self::Word(KeysWord::All))
    }

    /// How much may be lost, where keys may be left out.
    #[must_use]
    pub fn tolerance(&self) -> Option<KeyTolerance> {
        match self {
            Self::Word(KeysWord::All) => None,
            Self::Word(KeysWord::Needed) => Some(KeyTolerance::default()),
            Self::Needed(tolerance) => Some(*tolerance),
        }
    }
}

/// How much of the target goes into an output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum IncludeSpec {
    /// The target's whole document, where the format can hold it.
    #[default]
    #[serde(rename = "full")]
    Full,
    /// Joints and the clip; no mesh, no material.
    #[serde(rename = "skeleton+animation")]
    SkeletonAndAnimation,
}

/// What happens to the clips that the target has already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TargetClipsSpec {
    /// They follow the new one. An edit takes the place of the clip that it was made of, unless `clip_name` gives it another name.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}
