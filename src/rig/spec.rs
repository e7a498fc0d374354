//! The retarget spec: the one document in which a user says what is to be done. Every field is optional; `{}` means find
//! everything out. The doc comments here are the reference: the JSON Schema, the API document and the README take them over.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a clip is to be moved from one rig to another. Every field is optional; `{}` finds everything out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RetargetSpec {
    /// Version of this document's shape; 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: Option<u32>,
    /// The rig that the animation comes from.
    pub source: RigSpec,
    /// The rig that it goes onto.
    pub target: RigSpec,
    /// Which clip of the source file; its name, or its index from 0. Default: the first clip in which something moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip: Option<ClipChoice>,
    /// Whether the target's rest pose is turned to look like the source's before motion is transferred. Neither file is
    /// changed by it.
    pub align: Align,
    /// Which source chain drives which target chain. Default: by roles, then by equal names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<Vec<ChainMap>>,
    /// What is done, in this order. Default: `pelvis`, then `fk`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ops: Option<Vec<Op>>,
    /// What comes out: one output or a list. Default: GLB with everything of the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<OutputChoice>,
    /// How much is measured.
    pub report: ReportDetail,
    /// Turns warnings into an error.
    pub strict: bool,
}

/// What is known about one rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RigSpec {
    /// The joint that carries the body (the pelvis). Default: recognised.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root: Option<String>,
    /// The joint whose rest height counts as the ground under the pelvis. Default: the floor that the feet stand on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground: Option<String>,
    /// The pose that retargeting measures from.
    pub rest: RestSpec,
    /// Up and front axes of the file as two signed letters, such as `+y+z` or `+z-y`. Default `auto`: what the file says, checked
    /// against where the body's head, feet and hands are.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = r"^(auto|[+-][xyz][+-][xyz])$"))]
    pub axes: Option<String>,
    /// Metres per unit of length of the file. Default `auto`: what the file says, else a guess from the size of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitSpec>,
    /// Chains by name: first and last joint, the last below the first.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub chains: BTreeMap<String, [String; 2]>,
    /// Roles that recognition should not decide: role name to joint, or to a list of joints from the body outward. An empty
    /// list says that the rig has no such role.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub roles: BTreeMap<String, OneOrMany>,
}

/// One joint or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a joint name or a list of joint names")]
pub enum OneOrMany {
    /// One joint.
    One(String),
    /// Joints from the body outward.
    Many(Vec<String>),
}

impl OneOrMany {
    /// The joints, in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Many(names) => names,
        }
    }
}

/// A clip by name or by index.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a clip's name or its index from 0")]
pub enum ClipChoice {
    /// Index from 0, in the file's order.
    Index(usize),
    /// Exact name.
    Name(String),
}

/// A unit of length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected metres per unit as a number, or \"auto\"")]
pub enum UnitSpec {
    /// Metres per unit; above 0.
    Metres(f64),
    /// `auto`.
    Auto(AutoWord),
}

/// The word `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AutoWord {
    /// Find it out.
    Auto,
}

/// Where the rest pose comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"auto\", \"bind\", \"nodes\" or {\"clip\": …, \"frame\": …}")]
pub enum RestSpec {
    /// A rule.
    Rule(RestRule),
    /// A frame of a clip of the rig's own file (or of its rest upload).
    Frame(RestFrame),
}

impl Default for RestSpec {
    fn default() -> Self {
        Self::Rule(RestRule::Auto)
    }
}

/// A rule for the rest pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RestRule {
    /// The rest upload where there is one, else the bind pose where skins give one, else the node transforms.
    #[default]
    Auto,
    /// The pose in which the skins were bound.
    Bind,
    /// The node transforms of the file.
    Nodes,
}

/// A frame of a clip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestFrame {
    /// The clip, by name or index.
    pub clip: ClipChoice,
    /// The frame, from 0.
    #[serde(default)]
    pub frame: usize,
}

/// How the target's rest pose is turned to look like the source's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// `direction` for chains that come from roles, `off` for chains that the spec names joint by joint.
    #[default]
    Auto,
    /// The rest poses look alike already; nothing is turned.
    Off,
    /// Limbs, spine, neck, hands and fingers are turned until they point as the source's do; feet by heading only.
    Direction,
}

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
            rotation_alpha: 1.0,
            translation_alpha: 1.0,
        }
    }
}

/// One output or several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected an output or a list of outputs")]
pub enum OutputChoice {
    /// One.
    One(OutputSpec),
    /// Several; at most 8.
    Many(Vec<OutputSpec>),
}

/// One output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Wire name of the format, such as `glb`, `gltf`, `bvh`, `poses_npz`, `poses_json`; see `/v1/formats`.
    pub format: Option<String>,
    /// How much of the target goes into it.
    pub include: IncludeSpec,
    /// What happens to the clips that the target has already; the new one is always the first.
    pub target_clips: TargetClipsSpec,
    /// Name of the new clip. Default: the source clip's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_name: Option<String>,
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
    /// They follow the new one.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}

/// How much is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReportDetail {
    /// Timings, counts and warnings only.
    None,
    /// Measures per limb.
    #[default]
    Summary,
    /// Measures per limb and frame.
    Full,
}

/// The JSON Schema of [`RetargetSpec`], from the doc comments in this file.
#[must_use]
pub fn spec_schema() -> serde_json::Value {
    schemars::schema_for!(RetargetSpec).to_value()
}
