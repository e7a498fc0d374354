//! `floor`: soles on the floor, neither in it nor above it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Puts the soles of the target as far above its floor as the source's soles are above theirs, times the pelvis scale, while the
/// source's touch; at all other times they are only kept out of the floor.
///
/// What counts is the lowest point of the sole: of the mesh where there is one, else of a foot that is guessed from its joints. Where a
/// sole would go through the floor, toes bend first, then the foot tilts less, then it is lifted, and the pelvis goes along with the
/// feet that carry it. Needs a `contacts` op before it; in a clip in which nothing touches, as in a walk on the spot, feet that are
/// on the floor count as touching it. Where the source has no toes and feet that never turn
/// against the shins, as skeletons of points have, feet are set flat while they stand. Paws and hooves of animals are feet. Tails are
/// raised out of the floor, bone by bone; hands are kept out of it, and lie on it where the source's do. Mask: legs, such as `left_leg` or
/// `right_hind_leg`; default: all of them, tails and hands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FloorOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// How much soles follow the height of the source's between contacts too: 0 to 1. Below `falloff_height` only, and less and
    /// less above it.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub swing: f64,
    /// Meters of the source up to which `swing` counts fully, at a leg of 1 m. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub falloff_height: f64,
    /// Meters over which it ceases to count. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub falloff_distance: f64,
    /// Whether soles of the source that hover or sink in a contact by up to 4 cm, at a leg of 1 m, are taken to stand on the floor in
    /// it, when the target is not the source's figure: captures are often off by the thickness of shoes.
    pub adaptive: bool,
    /// Whether the pelvis is moved up and down with the feet that carry it, so that legs keep their bend.
    pub shift_pelvis: bool,
    /// Whether the pelvis is moved so that a trunk that sits or lies on the floor does so on the target too, however thick the bodies are:
    /// hips, waist and chest, as thick as the mesh where there is one. Not without `shift_pelvis`.
    pub trunk: bool,
    /// Whether hands and fingers are kept out of the floor, and are as far above it as the source's while those touch it, or nearly: wrists
    /// are moved up and down, and elbows bend.
    pub hands: bool,
}

impl Default for FloorOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            swing: 0.0,
            falloff_height: 0.08,
            falloff_distance: 0.2,
            adaptive: true,
            shift_pelvis: true,
            trunk: true,
            hands: true,
        }
    }
}
