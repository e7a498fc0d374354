//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

mod align;
mod auto_map;
mod error;
mod floor;
mod ikrig;
mod mapping;
mod nearest;
mod parse;
mod recognition;
mod resolve;
mod rest;
mod spec;
mod standing;
mod understand;
mod unknown_fields;

pub use error::{SpecError, SpecErrorKind, SpecField};
pub use mapping::{ChainPair, Chord, Drive, Mapping, PelvisPair, PelvisPosition};
pub use parse::{parse_spec, parse_value};
pub use recognition::{
    BodyFrame, Part, Recognition, RestPoseKind, RigKind, Role, RoleError, RoleFinding, Side, body_frame, recognise,
    report_doubts, rest_pose_kind,
};
pub use resolve::{Resolved, resolve};
pub use rest::{RestSource, scene_rest};
pub use spec::{
    Align, AutoWord, Carry, ChainMap, ClipChoice, EditSpec, FkOp, FractionRange, FrameRange, HeightRule, HoldSpec,
    IncludeSpec, InterpolationSpec, LoopRoot, LoopSpec, MirrorChoice, MirrorPlane, MirrorSpec, OneOrMany, Op,
    OutputChoice, OutputSpec, PelvisOp, PelvisScale, PelvisScaleRule, RangeSpec, ReportDetail, RestFrame, RestRule,
    RestSpec, RetargetSpec, RigSpec, RotationMode, ScaleOrigin, TargetClipsSpec, TranslationMode, UnitSpec,
    spec_schema,
};
pub use standing::with_standing_rest;
pub use understand::Rig;
