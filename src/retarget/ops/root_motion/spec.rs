//! `root_motion`: the figure's way is put onto its root joint, or taken out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Moves the figure's way over the floor from the pelvis to the root joint, or takes it out so that the figure stays in place.
///
/// The way is the pelvis' position along `axes`, and with `turn` its heading. `extract`: the root goes that way and the body
/// stays where it is: `L_pelvis = G_root⁻¹ · G_pelvis`. `remove`: the body goes back by it. With an alpha between 0 and 1, part of
/// the way is moved. There is no mask.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct RootMotionOp {
    /// When it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// What is done with the way.
    pub action: RootAction,
    /// The root joint of the target. Default: the one that was recognized, else the parent of the pelvis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<String>,
    /// Where the way comes from.
    pub from: RootSource,
    /// The root joint of the source, for `source_root`. Default: the one that was recognized, else the parent of the pelvis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source_joint: Option<String>,
    /// Along which axes.
    pub axes: Vec<RootAxis>,
    /// Whether the heading is part of the way.
    pub turn: bool,
    /// Where the root stands (`extract`).
    pub place: RootPlace,
    /// Half the width of the smoothing of the way; the sway of steps then stays in the body. 0 to 10 seconds.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub smoothing_seconds: f64,
}

impl Default for RootMotionOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            action: RootAction::default(),
            joint: None,
            from: RootSource::default(),
            source_joint: None,
            axes: vec![RootAxis::Left, RootAxis::Front],
            turn: false,
            place: RootPlace::default(),
            smoothing_seconds: 0.0,
        }
    }
}

/// What is done with the figure's way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootAction {
    /// The root goes it.
    #[default]
    Extract,
    /// Nobody goes it: the figure stays where it begins.
    Remove,
    /// It stays in the pelvis.
    Keep,
}

/// Where the figure's way comes from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootSource {
    /// The pelvis of the result.
    #[default]
    Pelvis,
    /// The root joint of the source, times the pelvis scale.
    SourceRoot,
}

/// An axis of the figure as it faces at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootAxis {
    /// To the sides.
    Left,
    /// Up and down.
    Up,
    /// To and fro.
    Front,
}

/// Where the root stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RootPlace {
    /// Straight below the pelvis; at the height of its rest pose, unless `up` is one of the axes.
    #[default]
    BelowPelvis,
    /// As far from the pelvis as at rest.
    RestOffset,
    /// It begins where it is at rest.
    FirstFrame,
}
