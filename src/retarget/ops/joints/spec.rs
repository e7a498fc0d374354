//! `joints`: a table that says joint by joint what follows what.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Drives joints one by one from a table, on top of what the ops before it gave. Joints below a driven one are carried along.
///
/// In `model` space, with `R` for the rest pose: `G_T = A · M(G_S · (G_S^R)⁻¹)^gain · A⁻¹ · G_T^R · offset`, about the figure's
/// left, up and front; positions are displaced from the rest position as the source's are, times the pelvis scale. In `local`
/// space the same is counted below the parents: `L_T = L_T^R · A · M((L_S^R)⁻¹ · L_S)^gain · A⁻¹ · offset`, about the joints'
/// own axes. `A` is `axis_offset`, `M` is `axis_order`. Mask: targets or roles of the table; default: all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct JointsOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// The table. A target may have several rows; parents are done before their children, else rows in their order.
    pub rows: Vec<JointRow>,
}

/// One row of the table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JointRow {
    /// A joint or a role of the source. Or two of them: the target's bone then points as the line from the first to the second,
    /// whatever lies between; how it is rolled, its parent says.
    pub source: JointSource,
    /// The joint or role of the target.
    pub target: String,
    /// Whether the position follows. Default: no.
    #[serde(default)]
    pub position: bool,
    /// Whether the rotation follows. Default: yes.
    #[serde(default = "yes")]
    pub rotation: bool,
    /// In which space changes are measured. Default: `model`.
    #[serde(default)]
    pub space: JointSpace,
    /// Factor on the displacement. −100 to 100. Default: 1.
    #[serde(default = "one")]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub position_gain: f64,
    /// Factor on the angle of rotation. −100 to 100. Default: 1.
    #[serde(default = "one")]
    #[schemars(range(min = -100.0, max = 100.0))]
    pub rotation_gain: f64,
    /// Meters that are added to the position: left, up and front in `model` space, along the parent's axes in `local` space.
    #[serde(default)]
    pub position_offset: [f64; 3],
    /// Degrees that the joint is turned further about its own axes, X then Y then Z.
    #[serde(default)]
    pub rotation_offset: [f64; 3],
    /// Which of the source's axes become the target's X, Y and Z, with signs: `xzy`, `+x-z+y`. It maps displacements, and the axes
    /// about which rotations turn. Default: `xyz`.
    #[serde(default = "plain_order")]
    pub axis_order: String,
    /// Degrees by which the target's axes lie turned against the source's, X then Y then Z: changes are turned by this before they
    /// are applied.
    #[serde(default)]
    pub axis_offset: [f64; 3],
    /// For two sources: the joint of the target that its bone leads to. Default: its farthest child.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub points_to: Option<String>,
}

impl JointRow {
    /// A row with every other field at its default.
    #[must_use]
    pub fn new(source: JointSource, target: String) -> Self {
        Self {
            source,
            target,
            position: false,
            rotation: true,
            space: JointSpace::default(),
            position_gain: 1.0,
            rotation_gain: 1.0,
            position_offset: [0.0; 3],
            rotation_offset: [0.0; 3],
            axis_order: plain_order(),
            axis_offset: [0.0; 3],
            points_to: None,
        }
    }
}

/// What a row follows.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected a joint or role, or two of them")]
pub enum JointSource {
    /// A joint or a role.
    Joint(String),
    /// The direction from the first to the second.
    Pair([String; 2]),
}

/// In which space a row measures changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JointSpace {
    /// The model, as the figure stands at rest: left, up, front. What points somewhere points there on the target too, whatever
    /// the axes of the joints and whatever their parents do.
    #[default]
    Model,
    /// Below the parent, in the joint's own axes, as channels of animation programs count. Axes that differ are the table's to
    /// say.
    Local,
}

const fn yes() -> bool {
    true
}

const fn one() -> f64 {
    1.0
}

fn plain_order() -> String {
    "xyz".to_owned()
}
