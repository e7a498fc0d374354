//! `pelvis`: moves and turns the pelvis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Metres that the pelvis is moved left, up and front, as the figure faces at rest.
    pub offset: [f64; 3],
    /// Share of the way from there to where the source's pelvis is, in metres of the source. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub blend_to_source: f64,
    /// `blend_to_source` on each axis: left, up, front. 0 to 1.
    pub blend_to_source_weights: [f64; 3],
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
            offset: [0.0; 3],
            blend_to_source: 0.0,
            blend_to_source_weights: [1.0; 3],
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
