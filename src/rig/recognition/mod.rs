//! What the joints of a skeleton mean: which joint plays which role, how sure that is, and why.
//!
//! Two witnesses are heard. Names ([`lexicon`], [`languages`], [`names`], [`template`]) say what a joint may be, and the hierarchy which of
//! its meanings holds ([`limbs`], [`trunk`], [`fingers`], [`quadruped`]). The shape ([`structure`]) is read without any name.
//! [`limb_names`] weighs the shape of a limb and all of its names as a whole; [`assign`] makes one assignment of both, and says how sure each role is. Nothing here decides how a role is driven.

mod assign;
mod body;
mod doubts;
mod extras;
mod facing;
mod finding;
mod fingers;
mod hints;
mod input_digest;
mod kind;
mod languages;
mod lexicon;
mod limb_names;
mod limbs;
mod memory;
mod names;
mod quadruped;
mod recognition_result;
mod recognize;
mod recognizer;
mod rest_kind;
mod role;
mod structure;
mod template;
mod trunk;

pub use doubts::report_doubts;
pub use extras::{Prop, TwistHelper};
pub(super) use facing::lean;
pub use facing::{BodyFrame, body_frame};
pub use finding::RoleFinding;
pub use hints::Hints;
pub use kind::RigKind;
pub use memory::RecognitionMemory;
pub use recognition_result::Recognition;
pub use recognize::recognize;
pub use recognizer::Recognizer;
pub use rest_kind::{RestPoseKind, rest_pose_kind};
pub use role::{Part, Role, RoleError, Side};
pub use template::{RigTemplate, builtin_templates, parse_template, template_schema};
