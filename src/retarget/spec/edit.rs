//! Edits of the clip around a retarget, or without one.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::LayerReference;
use crate::retarget::ops::FilterOp;

/// Edits of the clip. Whatever order they are written in, they are done in this one: `range`, `every`, `warp`, `speed`, `reverse`,
/// `ping_pong`, `loop`, `hold`, `fps`, `start_seconds`, `mirror`, `filter`, and last `additive`. Without any of them the clip keeps its own key times.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EditSpec {
    /// The part of the clip that is used: `[start, end]` in seconds of the clip's own key times, `{"frames": [first, last]}` counted
    /// from 0, `{"fraction": [0.25, 1]}`, or `{"cycles": 2}` for so many whole cycles of a walk or the like, which are found; a warning
    /// says where. Both ends belong to it; where an end lies between keys, a frame is put there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<RangeSpec>,
    /// So much of the clip before and after `range`, as far as there is, `filter` looks at as well; it is not in the result. Goes with
    /// `speed`, `reverse`, `fps`, `start_seconds`, `mirror` and `additive`. Seconds, 0 to 60.
    #[serde(skip_serializing_if = "is_none")]
    #[schemars(range(min = 0.0, max = 60.0))]
    pub margin_seconds: f64,
    /// Only every n-th frame of the range is kept, from the first on, and the last one. With `fps`, new frames are interpolated between
    /// the frames that are kept. 1 to 10000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 10000))]
    pub every: Option<u32>,
    /// Time warp: pairs `[clip seconds, new seconds]`, both rising, counted from the start of the range. Between them time runs
    /// along a smooth curve that never turns back; outside them at its own speed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warp: Option<Vec<[f64; 2]>>,
    /// How much faster than in the file. 0.001 to 1000; default 1. Poses and measures stay as they are at 1: what ops and measures decide
    /// by speed and duration, such as which feet stand, goes by the clock that the clip had before.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub speed: Option<f64>,
    /// Plays backward.
    pub reverse: bool,
    /// Plays forward, then backward; the turning frame is there once.
    pub ping_pong: bool,
    /// Makes the end flow into the start, and repeats.
    #[serde(rename = "loop", skip_serializing_if = "Option::is_none")]
    pub make_loop: Option<LoopSpec>,
    /// Stands still before and after.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hold: Option<HoldSpec>,
    /// Uniform frames: duration times fps, rounded, plus one; frame k lies at k / fps, and the last shows the end of the clip. Going
    /// to less than half the rate, the motion between frames is averaged. 0.01 to 1000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub fps: Option<f64>,
    /// How values between keys are found, for `fps` and the ends of `range`. The curves of an FBX that are not straight lines are
    /// evaluated as they are.
    pub interpolation: InterpolationSpec,
    /// Time of the first frame. Default: 0 where any edit of time is asked for, else as in the file. −1000000 to 1000000.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1_000_000.0, max = 1_000_000.0))]
    pub start_seconds: Option<f64>,
    /// Takes noise off rotations; its `mask` names roles, limbs, chains or joints of the clip's own rig.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub filter: Option<FilterOp>,
    /// Makes the clip additive: what it changes against the reference, as changes of the rest pose. `layer` puts such a clip back on top
    /// of another one with `"mode": "add", "reference": "rest"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub additive: Option<LayerReference>,
    /// Swaps left and right: `true`, or an object for more say.
    #[serde(skip_serializing_if = "MirrorChoice::is_off")]
    pub mirror: MirrorChoice,
}

impl EditSpec {
    /// Whether time stays as it is.
    #[must_use]
    pub fn keeps_time(&self) -> bool {
        let Self {
            range,
            margin_seconds: _,
            every,
            warp,
            speed,
            reverse,
            ping_pong,
            make_loop,
            hold,
            fps,
            interpolation: _,
            start_seconds,
            filter: _,
            additive: _,
            mirror: _,
        } = self;
        range.is_none()
            && every.is_none()
            && warp.is_none()
            && speed.is_none()
            && !reverse
            && !ping_pong
            && make_loop.is_none()
            && hold.is_none()
            && fps.is_none()
            && start_seconds.is_none()
    }
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_none(seconds: &f64) -> bool {
    *seconds == 0.0
}

/// A part of a clip; both ends belong to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "expected [start, end] in seconds, {\"frames\": [first, last]}, {\"fraction\": [start, end]} or {\"cycles\": count}"
)]
pub enum RangeSpec {
    /// In seconds of the clip's own key times.
    Seconds([f64; 2]),
    /// In frames from 0.
    Frames(FrameRange),
    /// In fractions of the clip's duration, 0 to 1.
    Fraction(FractionRange),
    /// Whole cycles, wherever they fit together best.
    Cycles(CycleRange),
}

/// Whole cycles of a clip whose poses come back.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CycleRange {
    /// How many. 1 to 1000.
    #[schemars(range(min = 1, max = 1000))]
    pub cycles: u32,
}

/// Frames from 0; both belong to it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameRange {
    /// First and last.
    pub frames: [usize; 2],
}

/// Fractions of the duration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FractionRange {
    /// Start and end, 0 to 1.
    pub fraction: [f64; 2],
}

/// Makes the end flow into the start, and repeats.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LoopSpec {
    /// How often the clip is played. 1 to 1000.
    #[schemars(range(min = 1, max = 1000))]
    pub times: u32,
    /// Over how much of its end the clip is bent toward its start; 0 leaves the seam as it is. Seconds, at least 0.
    #[schemars(range(min = 0.0, max = 1_000_000.0))]
    pub blend_seconds: f64,
    /// Where the character goes on from.
    pub root: LoopRoot,
}

impl Default for LoopSpec {
    fn default() -> Self {
        Self { times: 1, blend_seconds: 0.2, root: LoopRoot::default() }
    }
}

/// Where a repeated clip goes on from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LoopRoot {
    /// From where and in the direction it ended: a walk walks on.
    #[default]
    Travel,
    /// From where it began.
    Restart,
}

/// Stands still before and after.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct HoldSpec {
    /// Seconds before the first frame. 0 to 100000.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub before_seconds: f64,
    /// Seconds after the last frame. 0 to 100000.
    #[schemars(range(min = 0.0, max = 100_000.0))]
    pub after_seconds: f64,
}

/// How values between keys are found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum InterpolationSpec {
    /// Straight; rotations the short way at constant speed.
    #[default]
    Linear,
    /// Along a smooth curve through the keys (Catmull–Rom).
    Cubic,
}

/// Whether left and right are swapped.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected true, false or an object")]
pub enum MirrorChoice {
    /// Yes, or no.
    Switch(bool),
    /// Yes, in this way.
    Details(MirrorSpec),
}

impl Default for MirrorChoice {
    fn default() -> Self {
        Self::Switch(false)
    }
}

impl MirrorChoice {
    /// Whether nothing is mirrored.
    #[must_use]
    pub const fn is_off(&self) -> bool {
        matches!(self, Self::Switch(false))
    }

    /// In which way, where something is.
    #[must_use]
    pub fn details(&self) -> Option<MirrorSpec> {
        match self {
            Self::Switch(false) => None,
            Self::Switch(true) => Some(MirrorSpec::default()),
            Self::Details(details) => Some(details.clone()),
        }
    }
}

/// How left and right are swapped.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MirrorSpec {
    /// How poses are mirrored.
    #[serde(skip_serializing_if = "is_model")]
    pub mode: MirrorMode,
    /// The plane that the character's path is mirrored on; only for `model`.
    pub plane: MirrorPlane,
    /// The own axis of joints of the middle that points sideways: `"x"`, or `{"rotation": "x", "translation": "z"}` where rotations and
    /// translations need different ones; only for `components`. Default: found, joint by joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub center_axis: Option<MirrorAxis>,
    /// The same for the pelvis and what is above it, where it differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pelvis_axis: Option<MirrorAxis>,
    /// Joints that belong together beyond those found by roles, names and places: pairs of joint names. A joint paired with itself
    /// is on the middle plane.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pairs: Vec<[String; 2]>,
}

/// How poses are mirrored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MirrorMode {
    /// In model space, whatever way the joints' axes lie.
    #[default]
    Model,
    /// By components of local rotations with the rest pose taken out: twins swap them, joints of the middle negate all but one. Right
    /// where twins turn the same way about their own axes.
    Components,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_model(mode: &MirrorMode) -> bool {
    *mode == MirrorMode::Model
}

/// The sideways axis of a joint: one for everything, or one each for its rotation and its translation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"x\", \"y\", \"z\" or an object with \"rotation\" and \"translation\"")]
pub enum MirrorAxis {
    /// The joint's own axis, which mirrors its rotation and the translations of its children.
    Both(ComponentAxis),
    /// One each.
    Separate(SeparateAxes),
}

/// Axes for rotation and translation; what is left out is found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SeparateAxes {
    /// The joint's own axis about which its rotation keeps its sense.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation: Option<ComponentAxis>,
    /// The axis of its parent's space along which its translation changes sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub translation: Option<ComponentAxis>,
}

impl MirrorAxis {
    /// The axis for rotations, where one is given.
    #[must_use]
    pub const fn rotation(self) -> Option<ComponentAxis> {
        match self {
            Self::Both(axis) => Some(axis),
            Self::Separate(axes) => axes.rotation,
        }
    }

    /// The axis for translations in the parent's space, where one is given for them alone.
    #[must_use]
    pub const fn translation(self) -> Option<ComponentAxis> {
        match self {
            Self::Both(_) => None,
            Self::Separate(axes) => axes.translation,
        }
    }
}

/// An axis of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ComponentAxis {
    /// Its X.
    X,
    /// Its Y.
    Y,
    /// Its Z.
    Z,
}

impl ComponentAxis {
    /// As a unit vector.
    #[must_use]
    pub const fn vector(self) -> glam::DVec3 {
        match self {
            Self::X => glam::DVec3::X,
            Self::Y => glam::DVec3::Y,
            Self::Z => glam::DVec3::Z,
        }
    }
}

/// The plane that a character's path is mirrored on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MirrorPlane {
    /// The middle plane of the rest pose: what was to the left of where the rig was built is then to its right.
    #[default]
    Rest,
    /// The upright plane through the pelvis of the first frame, along the direction that the body faces there: the character starts
    /// where it did.
    Start,
}
