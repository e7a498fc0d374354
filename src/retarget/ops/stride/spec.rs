//! `stride`: longer or shorter steps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Makes steps longer or shorter, the track of the feet wider or narrower, and the figure's way with them.
///
/// With `d` for the place of the ball of the foot (or of the hand) from below the pelvis along the figure's front `f` and left `l`:
/// `g' = g + (forward − 1) · d_f · f + ((splay − 1) · d_l ± sideways) · l`. The pelvis goes `forward` times as far along its front,
/// and all goals with it, so that feet that stand still do so afterwards too. It belongs between `ik` and `plant`. Mask: the
/// limbs whose goals are spread; default: the legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct StrideOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Factor on the length of steps. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub forward: f64,
    /// Meters that each goal is moved away from the middle. −10 to 10.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub sideways: f64,
    /// Factor on the distance of goals from the middle. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub splay: f64,
    /// Where the figure's front is found.
    pub direction: StrideDirection,
    /// Whether the pelvis travels as much farther as steps are longer. Without it, feet slide.
    pub moves_pelvis: bool,
    /// Half the width of the smoothing of the front over time. 0 to 10 seconds.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub smoothing_seconds: f64,
}

impl Default for StrideOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            forward: 1.0,
            sideways: 0.0,
            splay: 1.0,
            direction: StrideDirection::default(),
            moves_pelvis: true,
            smoothing_seconds: 0.5,
        }
    }
}

/// Where the figure's front is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StrideDirection {
    /// Where the pelvis faces.
    #[default]
    Pelvis,
    /// Where the chest faces.
    Chest,
    /// How the goals as a whole lie turned against their rest pose.
    Goals,
    /// Where the pelvis travels; where it stands, the last front counts.
    Travel,
}
