//! The retarget spec: the one document in which a user says what is to be done. Every field is optional; `{}` means find
//! everything out. The doc comments here are the reference: the JSON Schema, the API document and `docs/reference/config.md` take them over.

mod bone_maps;
mod edit;
mod ikrig;
pub(in crate::retarget) mod joint_table;
mod layer;
mod map;
mod output;
mod parse;
mod report;
mod tune;
mod whole_clip;

pub use edit::{
    ComponentAxis, CycleRange, EditSpec, FractionRange, FrameRange, HoldSpec, InterpolationSpec, LoopRoot, LoopSpec,
    MirrorAxis, MirrorChoice, MirrorMode, MirrorPlane, MirrorSpec, RangeSpec,
};
pub use joint_table::{TableRow, write_table};
pub use layer::{LayerMode, LayerReference, LayerSpec};
pub use map::{ChainMap, RotationMode, TranslationMode};
pub use output::{
    CompressionSpec, IncludeSpec, KeyInterpolation, KeyTolerance, KeysSpec, KeysWord, OutputChoice, OutputSpec,
    TargetClipsSpec,
};
pub use parse::{is_own_shape, parse_by_schema, parse_document, parse_spec, parse_value};
pub use report::{MetricInfo, MetricName, ReportChoice, ReportDetail, ReportSpec, Threshold};
pub use tune::{TuneChoice, TuneParameter, TuneSpec};

use std::sync::OnceLock;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ops::Op;
use crate::rig::{Align, ClipChoice, MorphsSpec, PoseSpec, RigSpec};

/// How a clip is to be moved from one rig to another. Every field is optional; `{}` finds everything out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RetargetSpec {
    /// Version of this document's shape; 1.
    #[schemars(range(min = 1, max = 1))]
    #[serde(skip_serializing_if = "Option::is_none")]
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

/// The JSON Schema of [`RetargetSpec`], from the doc comments in this file. It is made once: every config is read by it.
#[must_use]
pub fn spec_schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(|| schemars::schema_for!(RetargetSpec).to_value())
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
