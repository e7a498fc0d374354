//! A twist joint that takes its share of what its limb is twisted by. (docs/algorithm/joints.md.)

pub(in crate::retarget) mod spec;

pub use self::spec::TwistOp;

use glam::{DQuat, DVec3};

use crate::model::rotation::twist_angle;

use crate::retarget::stages::posed::figure::Figure;

/// Twists up to here are shared as they are, radians; beyond, the share shrinks down to nothing at half a turn, where both
/// directions meet.
const MOST_TWIST: f64 = 150.0 / 180.0 * std::f64::consts::PI;

/// One joint beside its limb's bone.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct TwistStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) segment: usize,
    pub(in crate::retarget) against: Against,
    /// Along the limb, in the segment's own axes.
    pub(in crate::retarget) axis: DVec3,
    pub(in crate::retarget) segment_from_joint: DQuat,
    pub(in crate::retarget) share: f64,
    /// Joints below that stay where they are: the hand below a joint that splits the forearm.
    pub(in crate::retarget) left_behind: Vec<usize>,
}

/// Where the twist is seen.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) enum Against {
    /// Against what carries the limb; `carrier_from_segment` at rest.
    Carrier { slot: usize, carrier_from_segment: DQuat },
    /// Against what it leads to; `segment_from_end` at rest.
    End { slot: usize, segment_from_end: DQuat },
}

impl TwistStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let segment = figure.model(self.segment).rotation;
        let change = match self.against {
            Against::Carrier { slot, carrier_from_segment } => {
                carrier_from_segment.conjugate() * figure.model(slot).rotation.conjugate() * segment
            }
            Against::End { slot, segment_from_end } => {
                segment.conjugate() * figure.model(slot).rotation * segment_from_end.conjugate()
            }
        };
        let turn = DQuat::from_axis_angle(self.axis, eased(twist_angle(change, self.axis)) * self.share);
        figure.keep(&self.left_behind);
        figure.turn_to(self.slot, segment * turn * self.segment_from_joint);
        figure.put_back(&self.left_behind);
    }
}

fn eased(twist: f64) -> f64 {
    let beyond = (twist.abs() - MOST_TWIST).max(0.0) / (std::f64::consts::PI - MOST_TWIST);
    twist.clamp(-MOST_TWIST, MOST_TWIST) * (1.0 - beyond)
}
