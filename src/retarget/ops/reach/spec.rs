//! `reach`: ends of chains get to goals with the help of the body.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Moves the ends of any chains to goals, all at once, by turning the joints above them, and the pelvis where that is allowed: for
/// tails, tentacles and legs of many bones, and for hands that must get somewhere although the arm alone is too short.
///
/// Damped least squares: with `e` for what is left, weighed by goal and axis, and `r` for the way from a joint to an end, joints
/// turn by `ω = m · Σ r × y` and the pelvis goes by `m · Σ y`, where `(J M Jᵀ + d²) y = e`; again and again from the pose that the
/// ops before gave, so that the result depends on the frame alone. Ends keep how they are turned; what else hangs from a joint that
/// turns is carried along. Goals far out of reach pull limbs straight, and may pull them another way from frame to frame: give them
/// less weight or more depth. Limbs of two bones that no goal pulls beyond their reach are better served by `ik`. Mask: ends.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct ReachOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// What is to get where.
    pub goals: Vec<ReachGoal>,
    /// How freely the pelvis goes along, against the turning of joints; 0 leaves it where it is. 0 to 10.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub pelvis: f64,
    /// How stiff joints are, by role or joint: 0 is free, 1 does not turn. 0 to 1. Default: 0, and 0.5 for the spine.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub stiffness: BTreeMap<String, f64>,
    /// Rounds at most. 1 to 100.
    #[schemars(range(min = 1, max = 100))]
    pub iterations: u32,
    /// Share of a chain's length that is damped: higher is calmer where goals are out of reach, and slower. 0.001 to 1.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub damping: f64,
}

impl Default for ReachOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            goals: Vec::new(),
            pelvis: 0.0,
            stiffness: BTreeMap::new(),
            iterations: 20,
            damping: 0.05,
        }
    }
}

/// One end and where it should be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReachGoal {
    /// The joint or role of the target that is to get there; of a role with several joints the last.
    pub end: String,
    /// The joint or role of the source that says where. Default: the one of the same role.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// How the source's place becomes one of the target. Default: `world`.
    #[serde(default)]
    pub place: ReachPlace,
    /// How many joints above the end may turn. 1 to 100. Default: 2.
    #[serde(default = "two")]
    #[schemars(range(min = 1, max = 100))]
    pub depth: u32,
    /// How much of the way there is gone. 0 to 1. Default: 1.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub weight: f64,
    /// Factors along left, up and front: 0 lets the end be where it is along that axis. 0 to 1. Default: all 1.
    #[serde(default = "all")]
    pub axes: [f64; 3],
    /// Meters that the goal is moved to the left, up and to the front.
    #[serde(default)]
    pub offset: [f64; 3],
}

/// How a place of the source becomes a goal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ReachPlace {
    /// Above the floor and along it, times the pelvis scale: what the source touches, the target touches in its world.
    #[default]
    World,
    /// As seen from the first joint that may turn, times how much longer the target's chain is from there to the end. The source's
    /// first joint is the one of the same role, or as many joints above.
    Chain,
}

const fn two() -> u32 {
    2
}

const fn one() -> f64 {
    1.0
}

const fn all() -> [f64; 3] {
    [1.0; 3]
}
