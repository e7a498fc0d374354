//! `plant`: feet stay where they stand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Keeps feet where they stand while the source's touch the floor. Needs a `contacts` op before it.
///
/// What is held is the point that touches: the heel, then the ball while the heel lifts. Each foot stands where it deviates
/// least from the pose without this op, and is led there and away smoothly. Where the source walks on the spot, feet go along with the
/// floor that runs below it, in every mode but `never` and `grounding`; for that they are moved by 2 cm at most, at a leg of 1 m. Where
/// a held foot is out of reach, the pelvis is moved by the least that brings it into reach; hips that are wide for their legs are turned, too, and
/// what hangs on them is not. Mask: legs and arms, such as `left_leg` or
/// `right_hind_leg`; default: the legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct PlantOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// What is held.
    pub mode: PlantMode,
    /// Seconds over which a foot is led to its place before a contact and away from it afterwards. 0 to 2.
    #[schemars(range(min = 0.0, max = 2.0))]
    pub blend_seconds: f64,
    /// Whether feet that stand on an edge in all contacts with heel and ball are taken to stand level, when the target's feet are
    /// not the source's: rest poses with legs apart often have their feet on edge. By 3° nothing is done, from 8° on all.
    pub level: bool,
    /// Whether feet that are larger beside their legs than the source's turn less while they stand, by as much as they are larger:
    /// small turns would carry ankle and toes farther. At most 10° are taken off, and none of a foot that rolls or turns far. Feet of which the
    /// source does not say how they are turned stay up to 29° behind the shin while they stand.
    pub steady: bool,
    /// Whether the pelvis is moved, or turned, where a held foot is out of reach.
    pub pull_pelvis: bool,
    /// How much dearer it is to move the pelvis sideways than up or down. 1 to 100.
    #[schemars(range(min = 1.0, max = 100.0))]
    pub sideways_cost: f64,
}

impl Default for PlantOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            mode: PlantMode::default(),
            blend_seconds: 0.35,
            level: true,
            steady: true,
            pull_pelvis: true,
            sideways_cost: 2.0,
        }
    }
}

/// What `plant` holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PlantMode {
    /// In contacts a foot moves as much as the source's own does, scaled: what glides in the source glides.
    #[default]
    Auto,
    /// In contacts a foot does not move at all.
    Always,
    /// Nothing is held.
    Never,
    /// In contacts a foot keeps its height, and may glide.
    Grounding,
}
