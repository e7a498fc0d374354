//! A prop that a hand carries as the source's does. (docs/algorithm/joints.md.)

use crate::retarget::stages::posed::Step;
use crate::retarget::{mapping::Mapping, ops::edit::Edit, stages::posed::builder::StepBuilder};
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

impl Step for CarriedStep {
    fn apply(&self, figure: &mut Figure<'_>) {
        let (holder, prop) = (figure.source.model[self.source_holder], figure.source.model[self.source]);
        let away = holder.rotation.conjugate() * (prop.translation - holder.translation);
        let turned = holder.rotation.conjugate() * prop.rotation;
        let hand = figure.model(self.holder);
        let back = self.holder_turn.conjugate();
        figure.turn_to(self.slot, hand.rotation * back * turned * self.prop_turn);
        figure.move_to(self.slot, hand.translation + hand.rotation * (back * away) * self.scale);
    }
}

/// What carries a prop.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PropDrive {
    /// The prop of the target.
    pub(in crate::retarget) joint: usize,
    /// The prop of the source.
    pub(in crate::retarget) source: usize,
    /// What carries it.
    pub(in crate::retarget) holder: usize,
    /// What carries the source's.
    pub(in crate::retarget) source_holder: usize,
    /// Factor on the distance, in plan units.
    pub(in crate::retarget) scale: f64,
}

impl Edit for PropDrive {
    type Step = CarriedStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> CarriedStep {
        let stack = builder.stack;
        let turn = |source: usize, target: usize| {
            stack.source_rest[source].rotation.conjugate() * stack.target_rest[target].rotation
        };
        CarriedStep {
            slot: builder.change(self.joint, true, true),
            holder: builder.target(self.holder),
            source: builder.source(self.source),
            source_holder: builder.source(self.source_holder),
            holder_turn: turn(self.source_holder, self.holder),
            prop_turn: turn(self.source, self.joint),
            scale: self.scale,
        }
    }
}
