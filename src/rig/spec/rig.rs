//! What a user says of one rig.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{ClipChoice, PoseEdit};

/// What is known about one rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct RigSpec {
    /// The joint that carries the body (the pelvis). Default: recognized.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub root: Option<String>,
    /// Which character is meant where the file holds several: a joint or node that all of its joints are below, or its topmost joint.
    /// Default: the one with the most parts that are known by their names, and the warning `several_characters`. In a retarget, `all`
    /// moves every character of the target, up to eight: by the one of the source, or with `all` on both sides the first by the first,
    /// the second by the second and so on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub character: Option<String>,
    /// The joint whose rest height counts as the ground under the pelvis. Default: the floor that the feet stand on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ground: Option<String>,
    /// The pose that retargeting measures from.
    pub rest: RestSpec,
    /// Changes to that pose, one after the other: the retarget-pose editor.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pose: Vec<PoseEdit>,
    /// Joints that keep their own orientation in model space when this rig is aligned with the other (the target is).
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub keep_pose: Vec<String>,
    /// What a joint points at, for alignment: joint to joint. Default: the next part of the body, such as the middle finger for a
    /// hand. For joints with several children, and for chains that no role names.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub points_at: BTreeMap<String, String>,
    /// Up and front axes of the file as two signed letters, such as `+y+z` or `+z-y`. Default `auto`: what the file says, checked
    /// against where the body's head, feet and hands are.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(regex(pattern = r"^(auto|[+-][xyz][+-][xyz])$"))]
    pub axes: Option<String>,
    /// Meters per unit of length of the file. Default `auto`: what the file says, else a guess from the size of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<UnitSpec>,
    /// Chains by name: first and last joint, the last below the first.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub chains: BTreeMap<String, [String; 2]>,
    /// Roles that recognition should not decide: role name to joint, or to a list of joints from the body outward. An empty
    /// list says that the rig has no such role.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub roles: BTreeMap<String, OneOrMany>,
    /// Names that the joints of a role may have: for each joint from the body outward a list, of which the first that the rig has is
    /// taken, capitals or not. What the rig has none of stays as recognized, so the same names do for many rigs. `roles` wins.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub role_names: BTreeMap<String, Vec<Vec<String>>>,
    /// What the helper joints of an Unreal target do where `ops` does not say it: `ik_foot_l`, `ik_foot_r`, `ik_hand_gun`, `ik_hand_l`
    /// and `ik_hand_r`.
    #[serde(skip_serializing_if = "super::is_default")]
    pub helper_joints: HelperJoints,
}

/// What helper joints do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HelperJoints {
    /// They lie on the feet and hands of the result, turned as those are. The weapon's lies on the right hand.
    #[default]
    Follow,
    /// They keep their rest pose.
    Keep,
}

/// One joint or several.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a joint name or a list of joint names")]
pub enum OneOrMany {
    /// One joint.
    One(String),
    /// Joints from the body outward.
    Many(Vec<String>),
}

impl OneOrMany {
    /// The joints, in order.
    #[must_use]
    pub fn names(&self) -> &[String] {
        match self {
            Self::One(name) => std::slice::from_ref(name),
            Self::Many(names) => names,
        }
    }
}

/// A unit of length.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected meters per unit as a number, or \"auto\"")]
pub enum UnitSpec {
    /// Meters per unit; above 0.
    Meters(f64),
    /// `auto`.
    Auto(AutoWord),
}

/// The word `auto`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum AutoWord {
    /// Find it out.
    Auto,
}

/// Where the rest pose comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected \"auto\", \"bind\", \"nodes\", \"solved\" or {\"clip\": …, \"frame\": …}")]
pub enum RestSpec {
    /// A rule.
    Rule(RestRule),
    /// A frame of a clip of the rig's own file (or of its rest upload).
    Frame(RestFrame),
}

impl Default for RestSpec {
    fn default() -> Self {
        Self::Rule(RestRule::Auto)
    }
}

/// A rule for the rest pose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RestRule {
    /// The rest upload where there is one, else the bind pose where skins give one, else the node transforms. Where a file that does
    /// not say its axes (BVH) holds no body that stands at rest: the first frame of its clip that is one, else `solved`. Nodes
    /// that stand as in the first frame of their clip, in the middle of a step, count as that frame.
    #[default]
    Auto,
    /// The pose in which the skins were bound.
    Bind,
    /// The node transforms of the file.
    Nodes,
    /// A T pose, made of whatever `auto` gives: arms to the sides, legs down, spine up, by role.
    Solved,
}

/// A frame of a clip.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RestFrame {
    /// The clip, by name or index.
    pub clip: ClipChoice,
    /// The frame, from 0.
    #[serde(default)]
    pub frame: usize,
}
