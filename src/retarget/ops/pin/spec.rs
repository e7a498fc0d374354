//! `pin`: joints that follow another joint.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Lets joints follow another joint of the target, or one of the source: weapon sockets, `ik_hand` bones, cameras. Pins are done
/// in their order. Mask: pinned joints or roles; default: all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct PinOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// What follows what.
    pub pins: Vec<Pin>,
}

/// One joint that follows another.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pin {
    /// The joint or role of the target that follows.
    pub joint: String,
    /// The joint or role that it follows.
    pub to: String,
    /// Whose joint `to` is. Default: the target's.
    #[serde(default)]
    pub side: PinSide,
    /// How it follows. Default: `keep_offset`.
    #[serde(default)]
    pub mode: PinMode,
    /// Whether the position follows. Default: yes.
    #[serde(default = "yes")]
    pub position: bool,
    /// Whether the rotation follows. Default: yes.
    #[serde(default = "yes")]
    pub rotation: bool,
    /// Meters that the joint is moved along the axes that it then has.
    #[serde(default)]
    pub offset: [f64; 3],
    /// Degrees that it is turned further about its own axes, X then Y then Z.
    #[serde(default)]
    pub rotation_offset: [f64; 3],
    /// Whether joints below it are carried along. Otherwise those that are driven stay where they are. Default: yes.
    #[serde(default = "yes")]
    pub carries_children: bool,
}

/// Whose joint is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PinSide {
    /// The target's, as the ops before left it.
    #[default]
    Target,
    /// The source's. Distances are multiplied by the pelvis scale.
    Source,
}

/// How a pinned joint follows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PinMode {
    /// As if it hung below the other joint where it is at rest. Of the source, its change since the rest pose is followed.
    #[default]
    KeepOffset,
    /// It lies on the other joint, turned as that is.
    Global,
    /// It takes the other joint's transform below its parent.
    Local,
}

const fn yes() -> bool {
    true
}
