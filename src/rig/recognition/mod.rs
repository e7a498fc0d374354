//! What the joints of a skeleton mean: which joint plays which role, how sure that is, and why.
//!
//! Knows names, hierarchy and the rest pose. Decides nothing about how a role is driven.

mod body;
mod doubts;
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
mod template;
mod trunk;

pub use doubts::report_doubts;
pub use facing::{BodyFrame, body_frame};
pub use finding::RoleFinding;
pub use recognise::{Hints, Recognition, RigKind, recognise};
pub use rest_kind::{RestPoseKind, rest_pose_kind};
pub use role::{Part, Role, RoleError, Side};
pub use template::{RigTemplate, builtin_templates, parse_template, template_schema};
