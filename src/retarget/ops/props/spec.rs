//! `props`: things in hands, and hands that hold one thing.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Keeps things in hands as the source holds them.
///
/// A prop: `G_prop = G_hand_T · ((G_hand_S)⁻¹ · G_prop_S)`, with the hands' axes and the rest poses of both props taken into
/// account and the distance times `scale`. A grip: the other hand goes where the source has it, as seen from the dominant one.
/// Mask: props' joints or roles, and the other hands' roles or limbs; default: all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct PropsOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// Joints that are carried.
    pub props: Vec<CarriedProp>,
    /// Hands that hold the same thing.
    pub grips: Vec<Grip>,
}

/// A joint of the target that is carried as one of the source is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CarriedProp {
    /// The prop's joint in the source.
    pub source: String,
    /// The prop's joint in the target.
    pub target: String,
    /// The joint or role that carries it, on both sides. Default: the nearest hand, as the source carries it at the first frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holder: Option<String>,
    /// Factor on the distance between holder and prop. Default: how much larger the target's hands are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub scale: Option<f64>,
}

/// Two hands that hold the same thing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Grip {
    /// The hand that leads. Default: `right_hand`.
    #[serde(default)]
    pub dominant: GripHand,
    /// Meters between the source's hands, at an arm of 1 m, up to which the other hand follows fully; it follows less and less up to
    /// twice as much. 0 to 10. Default: 0.8.
    #[serde(default = "within")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub within: f64,
    /// Factor on the distance between the hands. Default: how much larger the target's hands are.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub scale: Option<f64>,
}

/// The hand that leads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GripHand {
    /// The right one.
    #[default]
    RightHand,
    /// The left one.
    LeftHand,
}

const fn within() -> f64 {
    0.8
}
