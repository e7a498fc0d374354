//! The retarget-pose editor: changes to the pose that retargeting measures from.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::ClipChoice;

/// One change to a rig's rest pose. The file itself is never changed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "edit", rename_all = "snake_case")]
pub enum PoseEdit {
    /// Turns a joint, and all below it.
    Rotate(RotateEdit),
    /// Takes joints from a frame of a clip.
    FromClip(FromClipEdit),
    /// Takes back all edits before this one.
    Reset(ResetEdit),
}

/// Turns a joint, and all below it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotateEdit {
    /// The joint.
    pub joint: String,
    /// Degrees about X, then Y, then Z of the axes below. −3600 to 3600 each.
    pub degrees: [f64; 3],
    /// The axes that are turned about.
    #[serde(default)]
    pub axes: EditAxes,
}

/// The axes that a joint is turned about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EditAxes {
    /// The character's: X to its left, Y up, Z to its front; whatever the axes of the file.
    #[default]
    Model,
    /// The joint's own, as it lies in the pose so far.
    Local,
}

/// Takes joints from a frame of a clip of the rig's own file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FromClipEdit {
    /// The clip, by name or index.
    pub clip: ClipChoice,
    /// The frame, from 0.
    #[serde(default)]
    pub frame: usize,
    /// The joints that take their rotation from it. Empty: all joints, translations included.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
}

/// Takes back the edits before it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ResetEdit {
    /// The joints that go back to how they are without edits, relative to their parents. Empty: all.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub joints: Vec<String>,
}

/// The pose of a character, as a file, instead of a retargeted clip.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PoseSpec {
    /// Which pose the target is put into.
    pub to: PoseChoice,
}

/// A pose that a character can be put into.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PoseChoice {
    /// Arms horizontal to the sides, legs down, spine up, palms down.
    #[default]
    T,
    /// The same with the arms 45° below the horizontal.
    A,
    /// As the source's rest pose, by the rules of `align`.
    Source,
    /// The target's own rest pose, with the edits of `target.pose`.
    Rest,
}
