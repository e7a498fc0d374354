//! Faces: which morph follows which.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How morph weights and expressions are moved over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MorphsSpec {
    /// Whether they are moved over at all.
    pub enabled: bool,
    /// Whether morphs that no row names are found by their names, in the vocabularies that are known: ARKit, VRM 0.x and 1.0, Oculus
    /// visemes, Character Creator, MetaHuman.
    pub by_name: bool,
    /// Finds the weights that move the target's face as the source's moves, whatever the shapes are called, by least squares over
    /// the vertices of both meshes; `{}` for the defaults. Rows still count for the shapes that they name, and names for none. Both
    /// files have to hold their meshes (GLB, glTF, VRM). Default: by names.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<MorphFitSpec>,
    /// Rows that say which target follows which source. Several rows of one target are combined.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rows: Vec<MorphRow>,
}

impl Default for MorphsSpec {
    fn default() -> Self {
        Self { enabled: true, by_name: true, fit: None, rows: Vec::new() }
    }
}

/// How weights are fitted to what meshes do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MorphFitSpec {
    /// Least and most of each weight. Default: `[0, 1]`.
    pub bounds: [f64; 2],
    /// What large weights cost, as a share of what a shape of average size moves: shapes that do nearly the same share their work
    /// evenly the higher it is. 0.000001 to 1.
    #[schemars(range(min = 0.000_001, max = 1.0))]
    pub regularization: f64,
}

impl Default for MorphFitSpec {
    fn default() -> Self {
        Self { bounds: zero_to_one(), regularization: 0.001 }
    }
}

/// One row: `target = clamp(gain · source + offset)`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MorphRow {
    /// A morph target or expression of the source.
    pub source: String,
    /// A morph target or expression of the target; all of that name.
    pub target: String,
    /// Factor. −100 to 100. Default: 1.
    #[serde(default = "one")]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub gain: f64,
    /// What is added. −100 to 100. Default: 0.
    #[serde(default)]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub offset: f64,
    /// Least and most that comes out. Default: `[0, 1]`.
    #[serde(default = "zero_to_one")]
    pub clamp: [f64; 2],
    /// How rows of one target are combined; that of the first row counts.
    #[serde(default)]
    pub combine: MorphCombine,
}

/// How several rows make one weight.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MorphCombine {
    /// Added, and clamped again as the first row says.
    #[default]
    Sum,
    /// The largest.
    Max,
    /// The smallest.
    Min,
    /// Multiplied.
    Product,
}

const fn one() -> f64 {
    1.0
}

const fn zero_to_one() -> [f64; 2] {
    [0.0, 1.0]
}
