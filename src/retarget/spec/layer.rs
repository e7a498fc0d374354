//! New motion over motion that the rig has already.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::rig::ClipChoice;

/// Lays what was made over a clip that the file has already: the target's own for a retarget, another clip of the same file for an
/// edit. Measures look at the motion before it is laid over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LayerSpec {
    /// The clip below; its name, or its index from 0. Default: the first in which something moves.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub over: Option<ClipChoice>,
    /// How the new motion goes with the clip below.
    pub mode: LayerMode,
    /// How much of the new motion is taken: 0 is none, 1 is all. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub weight: f64,
    /// Where the new motion counts: roles, limbs, chains or joints, each with all that is below it. Faces go along with
    /// the head. Default: everywhere.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<Vec<String>>,
    /// Over how many joints, from the first of each masked branch down, the weight rises to its full value. 0 to 100.
    #[schemars(range(min = 0, max = 100))]
    pub feather_joints: u32,
    /// What is taken out of the new motion before it is added; only for `add`.
    pub reference: LayerReference,
    /// When the new motion begins, in seconds of the clip below, which then gives the length and the key times. Default: the new
    /// motion gives them, and the clip below is played again from its start where it is shorter.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1_000_000.0, max = 1_000_000.0))]
    pub at_seconds: Option<f64>,
    /// Over how long a jump where the new motion begins and ends dies away; position and speed are continuous there. Only with
    /// `at_seconds`. Seconds, 0 to 1000.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub seam_seconds: f64,
}

impl Default for LayerSpec {
    fn default() -> Self {
        Self {
            over: None,
            mode: LayerMode::default(),
            weight: 1.0,
            mask: None,
            feather_joints: 0,
            reference: LayerReference::default(),
            at_seconds: None,
            seam_seconds: 0.3,
        }
    }
}

/// How new motion goes with the clip below.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayerMode {
    /// Takes its place; with a weight below 1, both are mixed.
    #[default]
    Replace,
    /// What changes against the reference comes on top.
    Add,
}

/// What an added motion is measured from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LayerReference {
    /// Its own first frame.
    #[default]
    FirstFrame,
    /// The mean of its frames.
    Mean,
    /// The rest transforms of the file.
    Rest,
}
