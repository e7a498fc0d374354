//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

mod align;
mod anatomy;
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
pub use floor::standing_floor;
pub use mapping::{ChainPair, Chord, Drive, Mapping, PelvisPair, PelvisPosition, Ride};
pub use parse::{parse_spec, parse_value};
pub use recognition::{
    BodyFrame, Hints, Part, Recognition, RestPoseKind, RigKind, RigTemplate, Role, RoleError, RoleFinding, Side,
    body_frame, builtin_templates, parse_template, recognise, report_doubts, rest_pose_kind, template_schema,
};
pub use resolve::{Resolved, resolve};
pub use rest::{RestSource, scene_rest};
pub use spec::*;
pub use standing::with_standing_rest;
pub use understand::Rig;
