//! The search for better parameters.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Whether parameters of the ops are searched so that the report's score is as low as can be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true, false or {\"max_evaluations\": …, \"bounds\": …}")]
pub enum TuneChoice {
    /// All parameters within their usual bounds, or none.
    Switch(bool),
    /// With limits of your own.
    Spec(TuneSpec),
}

/// What is searched, and how long.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct TuneSpec {
    /// Retargets that are tried at most, the first with the parameters as they are. 1 to 500.
    #[schemars(range(min = 1, max = 500))]
    pub max_evaluations: u32,
    /// Bounds by parameter, such as `{"pelvis.scale_horizontal": [0.8, 1.2]}`: only what is named is searched. Default: all
    /// parameters of the ops that run, within their usual bounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bounds: Option<BTreeMap<TuneParameter, [f64; 2]>>,
}

impl Default for TuneSpec {
    fn default() -> Self {
        Self { max_evaluations: 60, bounds: None }
    }
}

impl Default for TuneChoice {
    fn default() -> Self {
        Self::Switch(false)
    }
}

impl TuneChoice {
    /// What is searched; nothing where nothing is.
    #[must_use]
    pub fn spec(&self) -> Option<TuneSpec> {
        match self {
            Self::Switch(false) => None,
            Self::Switch(true) => Some(TuneSpec::default()),
            Self::Spec(spec) => Some(spec.clone()),
        }
    }
}

/// A parameter that can be searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
pub enum TuneParameter {
    /// How far the pelvis travels over the floor; usually 0.7 to 1.4.
    #[serde(rename = "pelvis.scale_horizontal")]
    PelvisScaleHorizontal,
    /// How far it moves up and down; usually 0.9 to 1.1.
    #[serde(rename = "pelvis.scale_vertical")]
    PelvisScaleVertical,
    /// How much of the pelvis' turn is taken; usually 0.9 to 1.1.
    #[serde(rename = "pelvis.rotation_alpha")]
    PelvisRotationAlpha,
    /// How long a foot is led to its place and away from it; usually 0.05 to 0.6.
    #[serde(rename = "plant.blend_seconds")]
    PlantBlendSeconds,
    /// Up to which height the floor counts fully; usually 0.02 to 0.2.
    #[serde(rename = "floor.falloff_height")]
    FloorFalloffHeight,
}

impl TuneParameter {
    /// All of them, in the order in which they are tried.
    pub const ALL: [Self; 5] = [
        Self::PelvisScaleHorizontal,
        Self::PelvisScaleVertical,
        Self::PelvisRotationAlpha,
        Self::PlantBlendSeconds,
        Self::FloorFalloffHeight,
    ];

    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::PelvisScaleHorizontal => "pelvis.scale_horizontal",
            Self::PelvisScaleVertical => "pelvis.scale_vertical",
            Self::PelvisRotationAlpha => "pelvis.rotation_alpha",
            Self::PlantBlendSeconds => "plant.blend_seconds",
            Self::FloorFalloffHeight => "floor.falloff_height",
        }
    }

    /// The bounds that nobody needs to name.
    #[must_use]
    pub const fn usual_bounds(self) -> [f64; 2] {
        match self {
            Self::PelvisScaleHorizontal => [0.7, 1.4],
            Self::PelvisScaleVertical | Self::PelvisRotationAlpha => [0.9, 1.1],
            Self::PlantBlendSeconds => [0.05, 0.6],
            Self::FloorFalloffHeight => [0.02, 0.2],
        }
    }
}
