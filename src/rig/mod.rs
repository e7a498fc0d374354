//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

mod align;
mod auto_map;
mod body;
mod doubts;
mod error;
mod facing;
mod finding;
mod findings;
mod fingers;
mod floor;
mod ikrig;
mod lexicon;
mod limbs;
mod mapping;
mod names;
mod nearest;
mod parse;
mod quadruped;
mod recognise;
mod resolve;
mod rest;
mod rest_kind;
mod role;
mod spec;
mod standing;
mod template;
mod trunk;
mod understand;
mod unknown_fields;

pub use doubts::report_doubts;
pub use error::{SpecError, SpecErrorKind, SpecField};
pub use facing::{BodyFrame, body_frame};
pub use finding::RoleFinding;
pub use findings::{FileFacts, Finding, FindingCode, Severity, examine, examine_clips};
pub use mapping::{ChainPair, Chord, Drive, Mapping, PelvisPair, PelvisPosition};
pub use parse::{parse_spec, parse_value};
pub use recognise::{Recognition, RigKind, recognise};
pub use resolve::{Resolved, resolve};
pub use rest::{RestSource, scene_rest};
pub use rest_kind::{RestPoseKind, rest_pose_kind};
pub use role::{Part, Role, RoleError, Side};
pub use spec::{
    Align, AutoWord, Carry, ChainMap, ClipChoice, FkOp, HeightRule, IncludeSpec, OneOrMany, Op, OutputChoice,
    OutputSpec, PelvisOp, PelvisScale, PelvisScaleRule, ReportDetail, RestFrame, RestRule, RestSpec, RetargetSpec,
    RigSpec, RotationMode, ScaleOrigin, TargetClipsSpec, TranslationMode, UnitSpec, spec_schema,
};
pub use standing::with_standing_rest;
pub use understand::{Rig, find_clip};
