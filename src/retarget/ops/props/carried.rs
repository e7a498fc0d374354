//! A prop that a hand carries as the source's does. (docs/algorithm/joints.md.)

use glam::DQuat;

use crate::retarget::stages::posed::figure::Figure;

/// One prop.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct CarriedStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) holder: usize,
    pub(in crate::retarget) source: usize,
    pub(in crate::retarget) source_holder: usize,
    /// `S0⁻¹ · T0` of the holders, and of the props.
    pub(in crate::retarget) holder_turn: DQuat,
    pub(in crate::retarget) prop_turn: DQuat,
    pub(in crate::retarget) scale: f64,
}

impl CarriedStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        let (holder, prop) = (figure.source.model[self.source_holder], figure.source.model[self.source]);
        let away = holder.rotation.conjugate() * (prop.translation - holder.translation);
        let turned = holder.rotation.conjugate() * prop.rotation;
        let hand = figure.model(self.holder);
        let back = self.holder_turn.conjugate();
        figure.turn_to(self.slot, hand.rotation * back * turned * self.prop_turn);
        figure.move_to(self.slot, hand.translation + hand.rotation * (back * away) * self.scale);
    }
}
