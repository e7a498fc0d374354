//! An upper arm that is turned away from the body.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::ArmSpacingOp;

use glam::{DQuat, DVec3};

use crate::retarget::stages::posed::figure::Figure;

/// One arm.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct ArmStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) chest: usize,
    /// The figure's front in the chest's own axes.
    pub(in crate::retarget) front: DVec3,
    pub(in crate::retarget) radians: f64,
}

impl ArmStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let front = (figure.model(self.chest).rotation * self.front).normalize_or(DVec3::Z);
        let now = figure.model(self.slot).rotation;
        figure.turn_to(self.slot, DQuat::from_axis_angle(front, self.radians) * now);
    }
}
