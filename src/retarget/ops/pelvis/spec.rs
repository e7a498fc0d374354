//! `pelvis`: moves and turns the pelvis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Alpha;

/// Moves and turns the pelvis.
///
/// Rotation: `G_T = turn_offset · Δ_S · G_T^R · local_turn_offset`. Position: `floor_T + scale · (position_S − floor_S)`, in meters,
/// +Y up; then the floor constraint, then the offsets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PelvisOp {
    /// Whether the op runs.
    pub enabled: bool,
    /// Multiplies both alphas: 0 leaves the pelvis at rest. A number from 0 to 1, keys over time, or a curve of the
    /// source.
    pub alpha: Alpha,
    /// First and last frame of the clip on which the op works, both included, from 0; at others the pelvis is at rest. Default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<[usize; 2]>,
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
    /// Meters that the pelvis is moved left, up and front, as the figure faces at rest.
    pub offset: [f64; 3],
    /// Share of the way from there to where the source's pelvis is, in meters of the source. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub blend_to_source: f64,
    /// `blend_to_source` on each axis: left, up, front. 0 to 1.
    pub blend_to_source_weights: [f64; 3],
    /// Meters that the pelvis is moved along its own axes.
    pub local_offset: [f64; 3],
    /// Degrees that the pelvis is turned about the figure's left, up and front, in this order. Chains that are measured in the model
    /// keep pointing as the source's do.
    pub turn_offset: [f64; 3],
    /// Degrees that it is turned about its own axes, X then Y then Z.
    pub local_turn_offset: [f64; 3],
    /// How much the height of the crotch is made to follow the source's instead of that of the pelvis joint, so that the target
    /// sits on the ground when the source does: `c_T = c_S · c_T^R / c_S^R` above the floors. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub floor_constraint: f64,
    /// Meters of the source that its crotch is below its pelvis joint. Default: half as far below the hips as they are apart.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_crotch: Option<f64>,
    /// Meters of the target that its crotch is below its pelvis joint. Default: as for the source.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_crotch: Option<f64>,
    /// The height of the crotch, as a share of that at rest, at which the floor constraint has faded out; 0 never fades it. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub floor_falloff: f64,
    /// How much the goals of limbs (`ik`, `plant`, `floor`) go along when this op moves the pelvis sideways, to or fro from where
    /// the scale alone puts it. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub affect_ik_horizontal: f64,
    /// The same up and down: at 0 a lowered pelvis bends the knees, at 1 it sinks the feet. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub affect_ik_vertical: f64,
}

impl Default for PelvisOp {
    fn default() -> Self {
        Self {
            enabled: true,
            alpha: Alpha::default(),
            frames: None,
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
            local_offset: [0.0; 3],
            turn_offset: [0.0; 3],
            local_turn_offset: [0.0; 3],
            floor_constraint: 0.0,
            source_crotch: None,
            target_crotch: None,
            floor_falloff: 0.0,
            affect_ik_horizontal: 1.0,
            affect_ik_vertical: 0.0,
        }
    }
}

/// How much the pelvis travels.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number, \"height\", \"legs\", \"stature\", \"limbs\" or \"none\"")]
pub enum PelvisScale {
    /// A fixed factor, target over source, in meters per meter.
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
    /// The ratio of the lengths of the legs, from hip to ankle; where one side has none, as `height`.
    Legs,
    /// The ratio of the heights of the whole figures, from the floor to the highest joint.
    Stature,
    /// Each direction by the limbs that make it: up and down as `height`, along the floor as `legs`, so that steps fit the legs.
    Limbs,
    /// Meters stay meters.
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
