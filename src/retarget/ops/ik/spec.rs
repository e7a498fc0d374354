//! `ik`: goals for the ends of limbs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Sets a goal for the end of each limb (ankle, wrist) and bends the limb so that it gets there.
///
/// The goals stand until the last op that moves goals (`ik`, `stride`, `plant`, `floor`) in a row has run; then limbs are
/// solved once. A limb of two bones is solved exactly: its plane stays that of forward kinematics. A leg of an animal has more bones:
/// it bends at the joint that leaves two parts as long as can be, which keep the shape that forward kinematics give them. What is out of
/// reach is approached softly, never beyond the extension that the source's limb has, and the distance left is reported. Mask: legs and
/// arms, such as `left_leg` or `right_hind_leg`; default: the legs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct IkOp {
    /// When and on which limbs it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Where goals come from.
    pub goal: IkGoal,
    /// Share of the way from the goal to where the source's end is, in meters of the source. 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub blend_to_source: f64,
    /// `blend_to_source` on each axis: right, up, front.
    pub blend_to_source_weights: [f64; 3],
    /// Share of the source's own rotation (instead of the one that forward kinematics gave). 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub blend_to_source_rotation: f64,
    /// Meters that goals are moved right, up and front, as the figure faces at rest.
    pub offset: [f64; 3],
    /// Meters that goals are moved along the end joint's own axes.
    pub local_offset: [f64; 3],
    /// Degrees that the end is turned about its own axes, X then Y then Z.
    pub rotation_offset: [f64; 3],
    /// Factor on the height of goals above the floor. 0 to 5.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub scale_vertical: f64,
    /// Factor on the distance from the limb's start to the goal. 0 to 5.
    #[schemars(range(min = 0.0, max = 5.0))]
    pub extension: f64,
    /// Share of a limb's length over which it approaches being straight, so that knees do not snap. 0 is off. 0 to 0.5.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub softness: f64,
    /// How much longer bones may get to reach a goal; 1 is not at all. 1 to 10.
    #[schemars(range(min = 1.0, max = 10.0))]
    pub stretch: f64,
    /// How much the bend is turned to where the source's points (its pole vector). 0 to 1.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub align_pole: f64,
    /// Degrees by which the bend is turned about the line from the limb's start to its end. −180 to 180.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub pole_offset: f64,
    /// Whether `align_pole` keeps the angle that both rest poses have between their bends.
    pub keep_pole_offset: bool,
}

impl Default for IkOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            goal: IkGoal::default(),
            blend_to_source: 0.0,
            blend_to_source_weights: [1.0; 3],
            blend_to_source_rotation: 0.0,
            offset: [0.0; 3],
            local_offset: [0.0; 3],
            rotation_offset: [0.0; 3],
            scale_vertical: 1.0,
            extension: 1.0,
            softness: 0.03,
            stretch: 1.0,
            align_pole: 0.0,
            pole_offset: 0.0,
            keep_pole_offset: true,
        }
    }
}

/// Where the goals of `ik` come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum IkGoal {
    /// Where forward kinematics put the end: bones point as the source's do.
    #[default]
    Fk,
    /// `start + (end_S − start_S) · length_T / length_S`: the limb as a whole points and bends as the source's does, also where
    /// its bones share the length otherwise.
    Limb,
}
