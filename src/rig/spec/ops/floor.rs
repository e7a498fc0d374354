//! `floor`: soles on the floor, neither in it nor above it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Scope;

/// Keeps the soles of the target as far above its floor as the source's soles are above theirs, times the pelvis scale.
///
/// At rest the floor is some way below ankle, ball and toes; the joint that comes nearest to it, by that measure, counts. Full strength up to
/// `falloff_height` of the source's sole, none from `falloff_height + falloff_distance` on, smooth between. Mask: `left_leg`,
/// `right_leg`; default: both.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FloorOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Metres of the source up to which the floor counts fully, at a leg of 1 m. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub falloff_height: f64,
    /// Metres over which it ceases to count. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub falloff_distance: f64,
    /// Whether soles that hover or sink in all contacts of the source are taken to stand on the floor, when the target's feet are
    /// not the source's: captures are often off by the thickness of shoes.
    pub adaptive: bool,
    /// Whether the pelvis is moved up or down by the mean correction of all contacts, so that legs keep their bend.
    pub shift_pelvis: bool,
}

impl Default for FloorOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            falloff_height: 0.08,
            falloff_distance: 0.2,
            adaptive: true,
            shift_pelvis: true,
        }
    }
}
