//! `copy_base_pose`: joints of equal names are copied as they are.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Copies the transform below the parent from joints of the source to joints of the target with the same names: for parts that
/// both rigs share, such as faces and props. Lengths are converted to the target's unit, nothing else. Mask: joints or roles of
/// the target; default: all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct CopyBasePoseOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Only this joint or role of the target and what is below it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub below: Option<String>,
    /// Whether positions are copied.
    pub position: bool,
    /// Whether rotations are copied.
    pub rotation: bool,
    /// Whether joints that `pelvis` and `fk` drive are copied over too.
    pub driven: bool,
}

impl Default for CopyBasePoseOp {
    fn default() -> Self {
        Self { scope: Scope::default(), below: None, position: true, rotation: true, driven: false }
    }
}
