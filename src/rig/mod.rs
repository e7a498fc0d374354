//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

mod alignment;
mod anatomy;
mod auto_map;
mod error;
mod floor;
mod ikrig;
mod legs;
mod mapping;
mod nearest;
mod parse;
mod posing;
mod recognition;
mod resolve;
mod rest;
mod shoulder;
mod spec;
mod twist;
mod understand;
mod unknown_fields;

pub use alignment::{AlignedJoint, CanonicalPose, HowAligned, RollCue};
pub use error::{SpecError, SpecErrorKind, SpecField};
pub use floor::standing_floor;
pub use mapping::{ChainPair, Chord, Drive, Mapping, PelvisPair, PelvisPosition, Ride, Spacing};
pub use parse::{parse_spec, parse_value};
pub use posing::{Posed, posed_target};
pub use recognition::{
    BodyFrame, Hints, Part, Prop, Recognition, RestPoseKind, RigKind, RigTemplate, Role, RoleError, RoleFinding, Side,
    TwistHelper, body_frame, builtin_templates, parse_template, recognise, report_doubts, rest_pose_kind,
    template_schema,
};
pub use resolve::{Resolved, resolve};
pub use rest::RestSource;
pub use shoulder::ShoulderPair;
pub use spec::{
    Align, AutoWord, Carry, ChainMap, ClipChoice, EditAxes, FkOp, FromClipEdit, HeightRule, IncludeSpec, MetricInfo,
    MetricName, OneOrMany, Op, OutputChoice, OutputSpec, PelvisOp, PelvisScale, PelvisScaleRule, PoseChoice, PoseEdit,
    PoseSpec, ReportChoice, ReportDetail, ReportSpec, ResetEdit, RestFrame, RestRule, RestSpec, RetargetSpec, RigSpec,
    RotateEdit, RotationMode, ScaleOrigin, TargetClipsSpec, Threshold, TranslationMode, UnitSpec, spec_schema,
};
pub use twist::{TwistAgainst, TwistPair};
pub use understand::Rig;
