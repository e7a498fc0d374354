//! `additive_pose`: a constant change of pose on top of the motion.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::{retarget::ops::Scope, rig::ClipChoice};

/// Turns joints of the target by a constant, on top of the motion: `L_T · d^alpha`, below the parent. For hands that should hold
/// something, shoulders that hunch. Mask: joints or roles; default: all that are named.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct AdditivePoseOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Joint or role to degrees about its own axes, X then Y then Z.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub degrees: BTreeMap<String, [f64; 3]>,
    /// A clip of the target file: `d` is the change from the rest pose to its pose at `frame`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clip: Option<ClipChoice>,
    /// Which frame of `clip`, from 0.
    pub frame: usize,
}
