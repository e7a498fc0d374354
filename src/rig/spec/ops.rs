//! The steps of a retarget and their parameters.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{RotationMode, TranslationMode};

/// In which frame a chain's rotation change is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Carry {
    /// The model: a limb points where the source's limb points, whatever its parents do.
    #[default]
    Model,
    /// The chain's own parent: the source chain is carried along under the target's parent, as ikrigretarget does it.
    Parent,
}

/// One step of the retarget.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "op", rename_all = "snake_case")]
pub enum Op {
    /// Moves and turns the pelvis.
    Pelvis(PelvisOp),
    /// Turns the chains by forward kinematics.
    Fk(FkOp),
}

/// Moves and turns the pelvis.
///
/// Rotation: `G_T = Δ_S · G_T^R`. Position: `floor_T + scale · (position_S − floor_S)`, in metres, +Y up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PelvisOp {
    /// Whether the op runs.
    pub enabled: bool,
    /// Blends both alphas at once: 0 leaves the pelvis at rest. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub alpha: f64,
    /// How much the pelvis travels.
    pub scale: PelvisScale,
    /// How the source's height is measured; see `target_height`.
    pub source_height: HeightRule,
    /// How the target's height is measured; the ratio of the two is the scale `height`.
    pub target_height: HeightRule,
    /// What positions are scaled about.
    pub origin: ScaleOrigin,
    /// 0 keeps the rest rotation. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub rotation_alpha: f64,
    /// 0 keeps the rest position. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub translation_alpha: f64,
    /// Extra factor on horizontal travel, after `scale`.
    pub scale_horizontal: f64,
    /// Extra factor on vertical travel, after `scale`.
    pub scale_vertical: f64,
}

impl Default for PelvisOp {
    fn default() -> Self {
        Self {
            enabled: true,
            alpha: 1.0,
            scale: PelvisScale::default(),
            source_height: HeightRule::default(),
            target_height: HeightRule::default(),
            origin: ScaleOrigin::default(),
            rotation_alpha: 1.0,
            translation_alpha: 1.0,
            scale_horizontal: 1.0,
            scale_vertical: 1.0,
        }
    }
}

/// How much the pelvis travels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, \"height\" or \"none\"")]
pub enum PelvisScale {
    /// A fixed factor, target over source, in metres per metre.
    Value(f64),
    /// A rule.
    Rule(PelvisScaleRule),
}

impl Default for PelvisScale {
    fn default() -> Self {
        Self::Rule(PelvisScaleRule::Height)
    }
}

/// A rule for the pelvis scale.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PelvisScaleRule {
    /// The ratio of the pelvis heights in the rest poses.
    Height,
    /// Metres stay metres.
    None,
}

/// How the height of a pelvis is measured in the rest pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeightRule {
    /// Above the floor: the `ground` joint where one is named, else where the feet stand.
    #[default]
    AboveFloor,
    /// Above the `ground` joint (ikrigretarget's `RootZMinusGroundZ`).
    AboveGroundJoint,
    /// Above the origin of the file (ikrigretarget's `RootZ`).
    AboveOrigin,
}

/// What pelvis positions are scaled about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleOrigin {
    /// The point of the floor under the file's origin, so that feet stay on the floor.
    #[default]
    Floor,
    /// The file's origin, as ikrigretarget does it.
    Origin,
}

/// Turns the chains by forward kinematics: `G_T = Δ_S · G_T^R` at equal places along the chains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FkOp {
    /// Whether the op runs.
    pub enabled: bool,
    /// Multiplies both alphas of every chain. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub alpha: f64,
    /// Only these roles or chains (names of the target side). Default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<Vec<String>>,
    /// In which frame rotation changes are measured.
    pub carry: Carry,
    /// How rotations are found.
    pub rotation: RotationMode,
    /// How translations are found.
    pub translation: TranslationMode,
    /// Whether joints of the target that share the twist of a limb get their share of it: twist helpers beside a bone, and the
    /// joints of a split one. The twist is that of the hand against the forearm (foot against shin), growing along the bone, and
    /// that of the upper arm against what carries it (thigh against pelvis), taken off toward the body. It follows the twist up
    /// to 150° from the rest pose and eases off beyond, so that nothing pops half a turn away.
    pub twist: bool,
    /// How much the clavicles of the target lift where the source has none: per degree that the upper arm is raised above its
    /// rest pose, and above 30° from hanging. 0 leaves them at rest. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub shoulder: f64,
    /// 0 keeps rest rotations. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub rotation_alpha: f64,
    /// 0 keeps rest translations. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub translation_alpha: f64,
}

impl Default for FkOp {
    fn default() -> Self {
        Self {
            enabled: true,
            alpha: 1.0,
            mask: None,
            carry: Carry::default(),
            rotation: RotationMode::default(),
            translation: TranslationMode::default(),
            twist: true,
            shoulder: 0.3,
            rotation_alpha: 1.0,
            translation_alpha: 1.0,
        }
    }
}
