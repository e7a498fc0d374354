//! What the joints mean: roles, recognition, chains, rest pose, alignment, and the spec in which users say so.
//!
//! Knows skeletons and poses; knows no file format and no frame loop.

mod alignment;
mod anatomy;
mod at_rest;
mod auto_map;
mod bone_maps;
mod build;
mod characters;
mod deserialize;
mod error;
mod findings;
mod floor;
mod humanoid;
mod ikrig;
mod joint_table;
mod leg_rows;
mod legs;
mod lookup;
mod mapping;
mod mask;
mod morphs;
mod named_pair;
mod nearest;
mod parse;
mod posing;
mod ranges;
mod recognition;
mod resolve;
mod rest;
#[expect(clippy::module_inception, reason = "a rig is what the module is about")]
mod rig;
mod shoulder;
mod soles;
mod spec;
mod stages;
mod tails;
mod twist;
mod unknown_fields;
mod volumes;

pub use alignment::{AlignedJoint, CanonicalPose, HowAligned, RollCue};
pub use error::{SpecError, SpecErrorKind, SpecField};
pub use findings::{FileFacts, Finding, FindingCode, Severity, examine, examine_clips};
pub use floor::{floors, standing_floor};
pub use humanoid::missing_bones;
pub use joint_table::{TableRow, write_table};
pub use lookup::find_clip;
pub use mapping::{
    ChainPair, Chord, ChordCorrection, CrotchRule, Drive, Mapping, PelvisPair, PelvisPosition, Ride, ShoulderPair,
    Spacing, TwistAgainst, TwistPair,
};
pub use mask::named_joints;
pub use morphs::{MorphDrive, MorphMapping, MorphTerm, map_morphs, morph_meaning};
pub use parse::{is_own_shape, parse_document, parse_spec, parse_value};
pub use posing::{Posed, posed_target};
pub use recognition::{
    BodyFrame, Hints, Part, Prop, Recognition, RestPoseKind, RigKind, RigTemplate, Role, RoleError, RoleFinding, Side,
    TwistHelper, body_frame, builtin_templates, parse_template, recognise, report_doubts, rest_pose_kind,
    template_schema,
};
pub use resolve::{Resolved, resolve, scheduled};
pub use rest::{OrientationFrom, RestFit, RestSource};
pub use rig::Rig;
pub use soles::{FootPoint, FootShape, SupportPoint};
pub use spec::*;
pub use stages::{
    ChainShape, ChainStretch, CopyDrive, CurveDrive, DriveFrom, FingerDrive, GripPair, Ground, JointDrive, JointLimit,
    Limb, LimbJoints, LimbPair, LimitFrame, PinDrive, PosedEdit, PropDrive, ReachDrive, ReachEnd, RootMotion, Schedule,
    Sole, SourceScale, StagedKind, StagedOp, Stages,
};
pub use tails::{Tail, TailJoint, TailPoint};
pub use volumes::{Anchor, BodyPart, Capsule, HandPair, body_capsules};
