//! When and on what an op works.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// When and on what an op works; every op has these fields.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct Scope {
    /// Whether the op runs.
    pub enabled: bool,
    /// How much of the op's change is taken: 0 is none, 1 is all. A number, keys over time, or a curve of the source.
    pub alpha: Alpha,
    /// Only these roles, limbs or chains (names of the target side). Default: all that the op is about.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<Vec<String>>,
    /// First and last frame of the clip on which the op works, both included, from 0. Default: all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<[usize; 2]>,
}

impl Default for Scope {
    fn default() -> Self {
        Self { enabled: true, alpha: Alpha::default(), mask: None, frames: None }
    }
}

/// An alpha that follows a curve of the source's clip: the weight of a morph or an expression. It is the curve times `gain` plus
/// `offset`, within 0 and 1.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AlphaCurve {
    /// Its name in the source.
    pub curve: String,
    /// Factor on it. Default: 1.
    #[serde(default = "one")]
    pub gain: f64,
    /// Added to it then. Default: 0.
    #[serde(default)]
    pub offset: f64,
}

/// How much of an op's change is taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a number from 0 to 1, a list of [seconds, alpha], or a curve")]
pub enum Alpha {
    /// The same at all times. 0 to 1.
    Constant(#[schemars(range(min = 0.0, max = 1.0))] f64),
    /// Keys of `[seconds, alpha]` in rising order of time; between them linear, before the first and after the last as they are.
    Keyed(Vec<[f64; 2]>),
    /// What a curve of the source's clip says.
    Curve(AlphaCurve),
}

impl Default for Alpha {
    fn default() -> Self {
        Self::Constant(1.0)
    }
}

impl Alpha {
    /// All of it.
    pub const ALL: Self = Self::Constant(1.0);

    /// The constant, where it is one.
    #[must_use]
    pub const fn constant(&self) -> Option<f64> {
        match self {
            Self::Constant(value) => Some(*value),
            Self::Keyed(_) | Self::Curve(_) => None,
        }
    }

    /// Whether values are from 0 to 1, and of keys there is at least one and their times rise.
    #[must_use]
    pub fn is_valid(&self) -> bool {
        let is_share = |value: &f64| (0.0..=1.0).contains(value);
        match self {
            Self::Constant(value) => is_share(value),
            Self::Keyed(keys) => {
                let in_range = keys.iter().all(|key| key[0].is_finite() && is_share(&key[1]));
                !keys.is_empty() && in_range && keys.windows(2).all(|pair| pair[0][0] < pair[1][0])
            }
            Self::Curve(curve) => curve.gain.is_finite() && curve.offset.is_finite(),
        }
    }
}

const fn one() -> f64 {
    1.0
}
