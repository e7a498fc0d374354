//! `limits`: joints bend no farther than bodies do.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Takes back what bends or twists a joint farther than a body does.
///
/// Angles are from the T pose, against the parent: about the bone (`twist`), in the direction in which the joint bends (`bend`)
/// and across (`side`); the last two make an ellipse. From `begin` of a limit on angles are compressed, so that nothing snaps:
/// `x' = b + (1 − b) · tanh((x − b) / (1 − b))`. Mask: roles or limbs; default: all roles with limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct LimitsOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Whether what the source itself does beyond a limit is left to the target, too: only what the retarget adds is taken back.
    pub relative: bool,
    /// The share of a limit up to which nothing is changed. 0 to 0.99.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub begin: f64,
    /// Limits of roles, instead of those that come with the program. A role without its side stands for both.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub ranges: BTreeMap<String, LimitRange>,
}

impl Default for LimitsOp {
    fn default() -> Self {
        Self { scope: Scope::default(), relative: true, begin: 0.8, ranges: BTreeMap::new() }
    }
}

/// How far a joint goes, in degrees from the T pose: pairs `[min, max]` with min from -180 to 0 and max from 0 to 180.
///
/// A pair that is left out is the one that comes with the program, or no limit where the program has none for the role. `null` in a
/// pair is no limit on that side: `[null, 30]`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LimitRange {
    /// Against and in the direction in which it bends: spines, necks, thighs, arms and forearms to the front, shins to the back,
    /// hands and feet up.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend: Option<[Option<f64>; 2]>,
    /// Across: toward the right and the left for the trunk, inward and outward (arms: down and up) for limbs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub side: Option<[Option<f64>; 2]>,
    /// About the bone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub twist: Option<[Option<f64>; 2]>,
}
