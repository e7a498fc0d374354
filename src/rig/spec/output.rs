//! What comes out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One output or several.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected an output or a list of outputs")]
pub enum OutputChoice {
    /// One.
    One(OutputSpec),
    /// Several; at most 8.
    Many(Vec<OutputSpec>),
}

/// One output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct OutputSpec {
    /// Wire name of the format, such as `glb`, `gltf`, `bvh`, `poses_npz`, `poses_json`; see `/v1/formats`.
    pub format: Option<String>,
    /// How much of the target goes into it.
    pub include: IncludeSpec,
    /// What happens to the clips that the target has already; the new one is always the first.
    pub target_clips: TargetClipsSpec,
    /// Name of the new clip. Default: the source clip's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip_name: Option<String>,
}

/// How much of the target goes into an output.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum IncludeSpec {
    /// The target's whole document, where the format can hold it.
    #[default]
    #[serde(rename = "full")]
    Full,
    /// Joints and the clip; no mesh, no material.
    #[serde(rename = "skeleton+animation")]
    SkeletonAndAnimation,
}

/// What happens to the clips that the target has already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TargetClipsSpec {
    /// They follow the new one.
    #[default]
    Keep,
    /// They are left out.
    Drop,
}
