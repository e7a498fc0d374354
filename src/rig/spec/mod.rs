//! What a user says of one rig, of a pose and of morph weights: the parts of the spec that are about what joints mean.

mod morphs;
mod pose;
mod rig;

pub use morphs::{MorphCombine, MorphFitSpec, MorphRow, MorphsSpec};
pub use pose::{EditAxes, FromClipEdit, PoseChoice, PoseEdit, PoseSpec, ResetEdit, RotateEdit};
pub use rig::{AutoWord, HelperJoints, OneOrMany, RestFrame, RestRule, RestSpec, RigSpec, UnitSpec};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A clip by name or by index.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a clip's name or its index from 0")]
pub enum ClipChoice {
    /// Index from 0, in the file's order.
    Index(usize),
    /// Exact name.
    Name(String),
}

/// How the target's rest pose is turned to look like the source's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Align {
    /// `full` for each joint whose roll is known better than it is off on both sides, else `direction`. Only chains that come from
    /// roles are turned; those that the spec names joint by joint are not, but where `points_at` says how.
    #[default]
    Auto,
    /// The rest poses look alike already; nothing is turned.
    Off,
    /// Limbs, spine, neck, hands and fingers are turned until they point as the source's do, the shortest way; feet by heading
    /// only.
    Direction,
    /// As `direction`, and each joint is then rolled about its direction as the source's is, wherever both sides tell: hands by
    /// their knuckles, thumb or mesh, arms and legs by the bend of elbow and knee, by the foot, or by how bodies are made.
    Full,
}

fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
