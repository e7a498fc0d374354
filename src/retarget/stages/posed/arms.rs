//! An upper arm that is turned away from the body.

use glam::{DQuat, DVec3};

use super::figure::Figure;

/// One arm.
#[derive(Clone, Copy, Debug)]
pub(super) struct ArmStep {
    pub(super) slot: usize,
    pub(super) chest: usize,
    /// The figure's front in the chest's own axes.
    pub(super) front: DVec3,
    pub(super) radians: f64,
}

impl ArmStep {
    pub(super) fn apply(&self, figure: &mut Figure<'_>) {
        let front = (figure.model(self.chest).rotation * self.front).normalize_or(DVec3::Z);
        let now = figure.model(self.slot).rotation;
        figure.turn_to(self.slot, DQuat::from_axis_angle(front, self.radians) * now);
    }
}
