//! The one pure function: input bytes and a spec to output bytes, warnings and a report.
//!
//! Knows no file system, no network, no clock but the one it is handed, and no job. Called by the command line, by the
//! workers of the service, by tests and by benches alike.

mod alignment;
mod annotate;
mod bound_rest;
mod characters;
mod compiled;
mod curves;
mod display;
mod draw;
mod drawn_bones;
mod edit;
mod explain;
mod face_fit;
mod facts;
mod failure;
mod files;
mod flat;
mod inspect;
mod keys;
mod knowledge;
mod labels;
mod layer;
mod limited;
mod memory;
mod morphs;
mod output_request;
mod outputs;
mod pictures;
mod pose;
mod preview;
mod propose;
mod provenance;
mod rest_file;
mod retarget;
mod retarget_run;
mod sections;
mod shown;
mod strict;
mod swapped_inputs;
mod task;
mod task_context;
mod transfer;
mod tune;
mod vrm_animation;

pub use crate::drawing::{
    BodyKind, DrawSpec, DrawingLimit, MAX_MODEL_BYTES, PoseModel, draw_spec_schema, drawing_limits,
};
#[allow(unused_imports, reason = "the service half asks for it, and the engine alone has no need of it")]
pub(crate) use crate::rig::nearest::nearest;
pub use alignment::AlignmentView;
pub use annotate::{
    AnnotatedDrawing, AnnotationView, BoxView, DrawnJointView, MaskView, annotate_drawing, body_kind, read_pose_model,
    tried_pose_model,
};
pub use characters::CharacterView;
pub use compiled::{Compiled, CompiledFacts};
pub use display::{DisplayOptions, display};
pub use draw::{
    DrawInputs, DrawRequest, DrawingFiles, DrawnCharacterView, DrawnReport, FileReader, draw, place_of_scene,
    read_draw_spec,
};
pub use edit::edited_clip;
pub use explain::{Contribution, Explanation, JointState, PelvisView, Question, SourceView, explain};
pub use face_fit::FaceFitView;
pub use facts::RigFacts;
pub use failure::{Failure, FailureCode, FieldError};
pub use flat::DrawingFacts;
pub use inspect::{
    ClipView, FindingView, Inspection, InspectionCounts, JointView, RigView, RoleView, inspect, inspect_with,
};
pub use keys::KeysView;
pub use knowledge::{
    Knowledge, built_in_presets, built_in_rigs, check_preset, check_rig, merge_config, merge_patch, parse_config,
};
pub use labels::{ByRole, OneOrMore};
pub use layer::laid_over;
pub use limited::LimitedView;
pub use memory::Memory;
pub use preview::{Preview, PreviewOptions, compare, has_figure, is_drawable, preview};
pub use propose::{DriverView, Proposal, ProposalCounts, RoleDoubts, RolePair, SourceShare, check_config, propose};
pub use rest_file::RestFileView;
pub use sections::{SectionedInputs, SectionsView, about_whole_clip, retarget_in_sections};
pub use strict::check_strict;
pub use task::{EMPTY_CONFIG, Task, TaskKind, edit, is_empty_config, retarget, retarget_with, run, task_of};
pub use transfer::{Transfer, transfer};
pub use tune::{TunedParameter, Tuning};

// The words that callers need to speak with the engine; the service half sees the pure half through this door only.
pub use crate::{
    formats::{
        Format, FormatInfo, FrameArrays, FrameArraysMut, JsonSize, Limits, PoseFrames, ReadSeek, SectionWriter,
        Sectioned, SectionedFile, WriteSeek, open_in_sections, pack_files, sniff,
    },
    model::{Control, Phase, Progress, no_json},
    picture::{Background, CameraKind, Follow, Layout, PictureFormat, Sheet, SheetSize, SheetWord, Sight, Style, View},
    retarget::spec_schema,
    rig::{FindingCode, PoseChoice, Severity, template_schema},
};

use serde::{Deserialize, Serialize};

use crate::{
    model::Warning,
    retarget::{ContactTrack, LimbReach, Measures},
};

/// A file as it came: its name (only its ending matters) and its bytes.
#[derive(Clone, Copy, Debug)]
pub struct NamedBytes<'a> {
    /// The file's name, without a folder.
    pub name: &'a str,
    /// Its content.
    pub bytes: &'a [u8],
}

/// What a retarget works on.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// The file with the animation.
    pub source: NamedBytes<'a>,
    /// The file with the character that it goes onto.
    pub target: NamedBytes<'a>,
    /// The source rig in its rest pose, where the source file does not hold it.
    pub source_rest: Option<NamedBytes<'a>>,
    /// The target rig in its rest pose, where the target file does not hold it.
    pub target_rest: Option<NamedBytes<'a>>,
    /// The retarget spec, JSON or YAML, or a config of another tool that we read.
    pub config: Option<NamedBytes<'a>>,
    /// Formats that the caller wants; they win over the spec's `output`. Empty: what the spec says, else GLB.
    pub formats: &'a [Format],
}

/// What an edit works on.
#[derive(Clone, Copy, Debug)]
pub struct EditInputs<'a> {
    /// The file with the animation; the edited clip goes back onto its skeleton.
    pub source: NamedBytes<'a>,
    /// The rig in its rest pose, where the file does not hold it.
    pub source_rest: Option<NamedBytes<'a>>,
    /// Whether a target was sent along, which is worth a warning.
    pub unread_target: bool,
    /// The spec, whose `edit` says what is to be done; JSON or YAML.
    pub config: Option<NamedBytes<'a>>,
    /// Formats that the caller wants; they win over the spec's `output`. Empty: what the spec says, else GLB.
    pub formats: &'a [Format],
}

/// What a character that is to be posed is made of.
#[derive(Clone, Copy, Debug)]
pub struct PoseInputs<'a> {
    /// The file with the character.
    pub target: NamedBytes<'a>,
    /// The character in its rest pose, where its file does not hold it.
    pub target_rest: Option<NamedBytes<'a>>,
    /// Another character, read only where its rest pose is the one to be taken.
    pub source: Option<NamedBytes<'a>>,
    /// The other character in its rest pose, where its file does not hold it.
    pub source_rest: Option<NamedBytes<'a>>,
    /// Which pose. `None`: the one that the spec says, else a T pose.
    pub to: Option<PoseChoice>,
    /// The retarget spec, JSON or YAML; the character is its target.
    pub config: Option<NamedBytes<'a>>,
    /// Formats that the caller wants; they win over the spec's `output`. Empty: what the spec says, else GLB.
    pub formats: &'a [Format],
}

/// One file that came out.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Output {
    /// Its format.
    pub format: Format,
    /// A file name for it.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

impl Output {
    /// A file of a format, with its name and content.
    #[must_use]
    pub const fn new(format: Format, name: String, bytes: Vec<u8>) -> Self {
        Self { format, name, bytes }
    }
}

/// What came out of a retarget.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Outcome {
    /// At least one file, in the order asked for.
    pub outputs: Vec<Output>,
    /// What was measured.
    pub report: Report,
    /// The spec with everything found out filled in; run again, it gives the same result.
    pub resolved_spec: serde_json::Value,
}

impl Outcome {
    /// Files with what was measured and the spec that they were made by.
    #[must_use]
    pub const fn new(outputs: Vec<Output>, report: Report, resolved_spec: serde_json::Value) -> Self {
        Self { outputs, report, resolved_spec }
    }
}

/// What was measured, as it goes to users.
#[derive(Clone, Debug, Default, Serialize)]
#[non_exhaustive]
pub struct Report {
    /// Wall time per phase.
    pub timings: Timings,
    /// How much there was.
    pub counts: Counts,
    /// Deviations, guesses and losses.
    pub warnings: Vec<WarningView>,
    /// What was found out about the two rigs.
    pub rigs: Rigs,
    /// When points of the source touch; empty without a `contacts` op. Fits `contacts.set` of a spec.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<ContactTrack>,
    /// How limbs reached their goals; empty without an op that sets some.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub reaches: Vec<LimbReach>,
    /// Joints that a `limits` op turned back, and in how many frames; absent where there are none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub limited: Vec<LimitedView>,
    /// What a search for better parameters found; absent when the spec asks for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tuning: Option<Tuning>,
    /// The characters that were moved, where all of a file were asked for; `measures` are then those of the one that it went worst with, and
    /// `contacts`, `reaches`, `limited` and `alignment` those of the first.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub characters: Vec<CharacterView>,
    /// How well the target's rest pose was turned to look like the source's, by joint, parents before children.
    pub alignment: Vec<AlignmentView>,
    /// How a clip was worked through that is too long to be held; absent where it was held. `contacts` and the curves of `measures` are then
    /// left out, and a measure is that of the section in which it is worst.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sections: Option<SectionsView>,
    /// How many keys outputs have that were asked to hold only what is needed.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keys: Vec<KeysView>,
    /// How well the face was fitted, where the spec asks for it by `morphs.fit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub face_fit: Option<FaceFitView>,
    /// The measures themselves, by name; absent when the spec asks for none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub measures: Option<Measures>,
    /// What was found of drawings that move, which are measured in another way.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drawing: Option<DrawnReport>,
}

/// Wall time per phase, in seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Timings {
    /// Decoding the input files.
    pub read_seconds: f64,
    /// Recognizing, aligning, compiling.
    pub plan_seconds: f64,
    /// Looking for better parameters.
    pub tune_seconds: f64,
    /// Plan and frame loop, nothing else.
    pub retarget_seconds: f64,
    /// Measuring the result.
    pub measure_seconds: f64,
    /// Encoding the outputs.
    pub write_seconds: f64,
    /// All of it.
    pub total_seconds: f64,
}

/// How much there was.
#[derive(Clone, Copy, Debug, Default, Serialize)]
#[non_exhaustive]
pub struct Counts {
    /// Frames of the clip.
    pub frames: usize,
    /// Joints of the source.
    pub source_joints: usize,
    /// Joints of the target.
    pub target_joints: usize,
    /// Target joints that the plan drives.
    pub driven_joints: usize,
}

/// What was found out about the two rigs.
#[derive(Clone, Debug, Default, Serialize)]
#[non_exhaustive]
pub struct Rigs {
    /// The source.
    pub source: RigFacts,
    /// The target.
    pub target: RigFacts,
}

/// A warning as it goes to users.
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct WarningView {
    /// Stable code.
    pub code: &'static str,
    /// Where.
    pub place: String,
    /// What was seen and done.
    pub detail: String,
    /// What the user can do.
    pub hint: String,
}

impl From<Warning> for WarningView {
    fn from(warning: Warning) -> Self {
        let Warning { code, place, detail, hint } = warning;
        Self { code, place, detail, hint }
    }
}
