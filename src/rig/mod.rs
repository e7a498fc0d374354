//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

pub(crate) mod alignment;
pub(crate) mod anatomy;
mod at_rest;
pub(crate) mod auto_map;
mod build;
mod characters;
pub(crate) mod deserialize;
pub(crate) mod error;
mod findings;
pub(crate) mod floor;
pub(crate) mod hands;
mod humanoid;
pub(crate) mod leg_rows;
pub(crate) mod legs;
pub(crate) mod limb;
pub(crate) mod limb_joints;
pub(crate) mod lookup;
mod mask;
mod morphs;
pub(crate) mod named_pair;
pub(crate) mod nearest;
pub(crate) mod palms;
mod posing;
pub(crate) mod ranges;
pub(crate) mod recognition;
pub(crate) mod rest;
#[expect(clippy::module_inception, reason = "a rig is what the module is about")]
pub(crate) mod rig;
pub(crate) mod rig_memory;
pub(crate) mod soles;
mod spec;
pub(crate) mod tails;
pub(crate) mod unknown_fields;
pub(crate) mod volumes;

pub use alignment::{AlignedJoint, CanonicalPose, HowAligned, RollCue};
pub use anatomy::Ride;
pub use characters::ALL_CHARACTERS;
pub use error::{SpecError, SpecErrorKind, SpecField};
pub(crate) use findings::mesh_off_joints;
pub use findings::{FileFacts, Finding, FindingCode, Severity, examine, examine_clips};
pub use floor::{floors, standing_floor};
pub use humanoid::missing_bones;
pub use limb::{Limb, LimbJoints, Sole};
pub use lookup::find_clip;
pub use mask::named_joints;
pub use morphs::{MorphDrive, MorphMapping, MorphTerm, map_morphs, morph_meaning};
pub(crate) use palms::palm;
pub use posing::{Posed, posed_target};
pub use recognition::{
    BodyFrame, Hints, Part, Prop, Recognition, RecognitionMemory, Recognizer, RestPoseKind, RigKind, RigTemplate, Role,
    RoleError, RoleFinding, Side, TwistHelper, body_frame, builtin_templates, parse_template, recognize, report_doubts,
    rest_pose_kind, template_schema,
};
pub use rest::{OrientationFrom, RestFit, RestSource};
pub use rig::Rig;
pub use soles::{FootPoint, FootShape, SupportPoint};
pub use spec::*;
pub use tails::{Tail, TailJoint, TailPoint};
pub(crate) use volumes::trunk_ends;
pub use volumes::{Anchor, BodyPart, Capsule, HandPair, body_capsules};
