//! `scale_source`: a larger or smaller source.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Scales the source's motion before anything else is done with it, wherever the op stands. Its rest pose stays, so that the
/// figure does not count as larger: it goes farther and jumps higher. There are no alpha, mask and frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ScaleSourceOp {
    /// Whether it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Factor. 0.01 to 100.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub factor: f64,
    /// The point that stays where it is: the file's origin, or a joint or role, at every frame anew.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pivot: Option<String>,
    /// Whether that point is taken down to the floor.
    pub on_floor: bool,
}

impl Default for ScaleSourceOp {
    fn default() -> Self {
        Self { scope: Scope::default(), factor: 1.0, pivot: None, on_floor: true }
    }
}
