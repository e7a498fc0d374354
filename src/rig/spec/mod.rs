//! The retarget spec: the one document in which a user says what is to be done. Every field is optional; `{}` means find
//! everything out. The doc comments here are the reference: the JSON Schema, the API document and `docs/reference/config.md` take them over.

mod edit;
mod layer;
mod map;
mod morphs;
mod ops;
mod output;
mod pose;
mod report;
mod rig;
mod tune;

pub use edit::{
    ComponentAxis, CycleRange, EditSpec, FractionRange, FrameRange, HoldSpec, InterpolationSpec, LoopRoot, LoopSpec,
    MirrorAxis, MirrorChoice, MirrorMode, MirrorPlane, MirrorSpec, RangeSpec,
};
pub use layer::{LayerMode, LayerReference, LayerSpec};
pub use map::{ChainMap, RotationMode, TranslationMode};
pub use morphs::{MorphCombine, MorphFitSpec, MorphRow, MorphsSpec};
pub use ops::{
    AdditivePoseOp, Alpha, AlphaCurve, ArmSpacingOp, CarriedProp, Carry, ContactCurve, ContactFloor, ContactFloorRule,
    ContactsOp, CopyBasePoseOp, CurveRow, CurvesOp, FilterKind, FilterOp, FingersOp, FkOp, FloorOp, Grip, GripHand,
    HeightRule, IkGoal, IkOp, JointRow, JointSource, JointSpace, JointsOp, LimitRange, LimitsOp, Op, OtherCurves,
    PelvisOp, PelvisScale, PelvisScaleRule, Pin, PinMode, PinOp, PinSide, PlantMode, PlantOp, PropsOp, ReachGoal,
    ReachOp, ReachPlace, RootAction, RootAxis, RootMotionOp, RootPlace, RootSource, ScaleOrigin, ScaleSourceOp, Scope,
    SelfContactOp, StretchChainOp, StrideDirection, StrideOp, TwistOp,
};
pub use output::{
    CompressionSpec, IncludeSpec, KeyInterpolation, KeyTolerance, KeysSpec, KeysWord, OutputChoice, OutputSpec,
    TargetClipsSpec,
};
pub use pose::{EditAxes, FromClipEdit, PoseChoice, PoseEdit, PoseSpec, ResetEdit, RotateEdit};
pub use report::{MetricInfo, MetricName, ReportChoice, ReportDetail, ReportSpec, Threshold};
pub use rig::{AutoWord, HelperJoints, OneOrMany, RestFrame, RestRule, RestSpec, RigSpec, UnitSpec};
pub use tune::{TuneChoice, TuneParameter, TuneSpec};

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a clip is to be moved from one rig to another. Every field is optional; `{}` finds everything out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RetargetSpec {
    /// Version of this document's shape; 1.
    #[schemars(range(min = 1, max = 1))]
    pub version: Option<u32>,
    /// What is asked for.
    #[serde(skip_serializing_if = "is_default")]
    pub task: Task,
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
    /// Asks for the target in a pose, as a file, instead of a clip: nothing is retargeted, and the source is looked at only where
    /// the pose is taken from it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseSpec>,
    /// What is done, in this order. Default: `pelvis` and `fk`; where legs are mapped, then `contacts`, `ik`, `plant` and `floor`, so
    /// that feet stay where they stand; where the target has the helper joints of Unreal rigs, then a `pin` that keeps them on hands and
    /// feet; where the source animates custom properties, then `curves`. At most 256.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ops: Option<Vec<Op>>,
    /// How morph weights and facial expressions are moved over.
    #[serde(skip_serializing_if = "is_default")]
    pub morphs: MorphsSpec,
    /// Edits of the clip: its time, its seams, its sides.
    #[serde(skip_serializing_if = "is_default")]
    pub edit: EditSpec,
    /// Lays what was made over a clip that the target has already; for an edit, over another clip of the same file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub layer: Option<LayerSpec>,
    /// What comes out: one output or a list. Default: GLB with everything of the target.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub output: Option<OutputChoice>,
    /// How much is measured, and from which value on it is called bad.
    pub report: ReportChoice,
    /// Whether parameters of the ops are searched so that the report's score is as low as can be: true, or limits and bounds. The
    /// spec that is found is in the resolved one. Default: they are taken as they are.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tune: Option<TuneChoice>,
    /// Turns warnings, and measures that fail, into an error.
    pub strict: bool,
}

/// What a spec asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Task {
    /// The source's clip, edited where `edit` says so, on the target.
    #[default]
    Retarget,
    /// The source's clip, edited as `edit` says, on the source itself. Nothing is retargeted, and the target is not looked at.
    Edit,
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

/// How the target's rest pose is turned to look like the source's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// `full` for each joint whose roll is known better than it is off on both sides, else `direction`. Only chains that come from
    /// roles are turned; those that the spec names joint by joint are not, but where `points_at` says how.
    #[default]
    Auto,
    /// The rest poses look alike already; nothing is turned.
    Off,
    /// Limbs, spine, neck, hands and fingers are turned until they point as the source's do, the shortest way; feet by heading
    /// only.
    Direction,
    /// As `direction`, and each joint is then rolled about its direction as the source's is, wherever both sides tell: hands by
    /// their knuckles, thumb or mesh, arms and legs by the bend of elbow and knee, by the foot, or by how bodies are made.
    Full,
}

/// The JSON Schema of [`RetargetSpec`], from the doc comments in this file. It is made once: every config is read by it.
#[must_use]
pub fn spec_schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(|| schemars::schema_for!(RetargetSpec).to_value())
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
