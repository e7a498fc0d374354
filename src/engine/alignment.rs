//! How well two rest poses look alike, as users see it.

use serde::Serialize;

use crate::{
    model::Skeleton,
    rig::{AlignedJoint, RollCue},
};

/// What was done to one joint of the target's rest pose, and what is left between it and the source's.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AlignmentView {
    /// The role, or the chain's name.
    pub role: String,
    /// The target's joint.
    pub joint: String,
    /// What was aligned: `full` (direction and roll), `direction`, `whole` (with its chain, whose own bends stay), `sloped`,
    /// `heading`, `kept` or `off`.
    pub aligned: &'static str,
    /// How far the joint was turned in model space, degrees.
    pub turned_degrees: f64,
    /// The angle left between the two directions; absent where the joint has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction_degrees: Option<f64>,
    /// The roll left about the direction, −180 to 180; absent where one of the two sides does not tell.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_degrees: Option<f64>,
    /// What the roll is known from on the source and on the target: `knuckles`, `thumb`, `mesh`, `bend`, `foot`, `eyes`,
    /// `shoulders`, `convention`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roll_from: Option<[&'static str; 2]>,
}

/// The joints of an alignment, degrees to the thousandth.
pub(super) fn view(alignment: &[AlignedJoint], skeleton: &Skeleton) -> Vec<AlignmentView> {
    // Adding zero makes a negative zero positive.
    let rounded = |degrees: f64| (degrees * 1e3).round() / 1e3 + 0.0;
    let names = |(source, target): (RollCue, RollCue)| [source.name(), target.name()];
    let joint = |joint: &AlignedJoint| AlignmentView {
        role: joint.name.clone(),
        joint: skeleton.label(joint.joint),
        aligned: joint.how.name(),
        turned_degrees: rounded(joint.turned_degrees),
        direction_degrees: joint.direction_degrees.map(rounded),
        roll_degrees: joint.roll_degrees.map(rounded),
        roll_from: joint.roll_from.map(names),
    };
    alignment.iter().map(joint).collect()
}
