//! What the joints mean: roles, recognition, facing, rest pose.
//!
//! Knows skeletons and poses; knows no file format and no retargeting algorithm.

mod body;
mod facing;
mod finding;
mod fingers;
mod lexicon;
mod limbs;
mod names;
mod quadruped;
mod recognise;
mod rest_kind;
mod role;
mod scene_rest;
mod template;
mod trunk;

pub use facing::{BodyFrame, body_frame};
pub use finding::RoleFinding;
pub use recognise::{Recognition, RigKind, recognise};
pub use rest_kind::{RestPoseKind, rest_pose_kind};
pub use role::{Part, Role, RoleError, Side};
pub use scene_rest::{RestSource, scene_rest};
