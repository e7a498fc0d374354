//! `fk`: turns the chains by forward kinematics.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::{
    ops::Alpha,
    spec::{RotationMode, TranslationMode},
};

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

/// Turns the chains by forward kinematics: `G_T = Δ_S · G_T^R` at equal places along the chains.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FkOp {
    /// Whether the op runs.
    pub enabled: bool,
    /// Multiplies both alphas of every chain: 0 leaves them at rest. A number from 0 to 1, keys over time, or a curve of the
    /// source.
    pub alpha: Alpha,
    /// First and last frame of the clip on which the op works, both included, from 0; at others its chains are at rest. Default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<[usize; 2]>,
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
    /// to 120° from the rest pose and eases off beyond, so that nothing pops half a turn away.
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
    /// How much the bend of arms and legs is turned to where the source's points (its pole vector), about the line from start to
    /// end; hands and feet keep how they are turned. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub align_pole: f64,
    /// Degrees by which the bend is turned further. −180 to 180.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub pole_offset: f64,
    /// Whether `align_pole` keeps the angle that both rest poses have between their bends.
    pub keep_pole_offset: bool,
}

impl Default for FkOp {
    fn default() -> Self {
        Self {
            enabled: true,
            alpha: Alpha::default(),
            frames: None,
            mask: None,
            carry: Carry::default(),
            rotation: RotationMode::default(),
            translation: TranslationMode::default(),
            twist: true,
            shoulder: 0.3,
            rotation_alpha: 1.0,
            translation_alpha: 1.0,
            align_pole: 0.0,
            pole_offset: 0.0,
            keep_pole_offset: true,
        }
    }
}
