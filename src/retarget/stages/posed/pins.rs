//! A joint that follows another.

use glam::{DMat3, DQuat, DVec3};

use crate::{
    model::Transform,
    rig::{PinMode, PinSide},
};

use super::figure::Figure;

/// One pin.
#[derive(Clone, Debug)]
pub(super) struct PinStep {
    pub(super) slot: usize,
    pub(super) to: usize,
    pub(super) side: PinSide,
    pub(super) mode: PinMode,
    pub(super) position: bool,
    pub(super) rotation: bool,
    /// In plan units.
    pub(super) offset: DVec3,
    pub(super) rotation_offset: DQuat,
    /// The rest poses of both joints in plan space.
    pub(super) rest: Transform,
    pub(super) to_rest: Transform,
    /// What a displacement of the source becomes, and what is added to it.
    pub(super) travel: DMat3,
    pub(super) raised: DVec3,
    /// Factor on lengths below a parent of the source.
    pub(super) local_scale: f64,
    /// Joints below that stay where they are.
    pub(super) left_behind: Vec<usize>,
}

impl PinStep {
    pub(super) fn apply(&self, figure: &mut Figure<'_>) {
        let (rotation, position) = match (self.mode, self.side) {
            (PinMode::Local, side) => self.beside(figure, side),
            (PinMode::Global, PinSide::Target) => {
                let to = figure.model(self.to);
                (to.rotation, to.translation)
            }
            (PinMode::Global, PinSide::Source) => {
                let to = figure.source.model[self.to];
                (to.rotation, to.translation)
            }
            (PinMode::KeepOffset, PinSide::Target) => {
                let to = figure.model(self.to);
                let offset = self.to_rest.relative(&self.rest);
                (to.rotation * offset.rotation, to.transform_point(offset.translation))
            }
            (PinMode::KeepOffset, PinSide::Source) => {
                let to = figure.source.model[self.to];
                let moved = self.travel * (to.translation - self.to_rest.translation) + self.raised;
                (to.rotation * self.to_rest.rotation.conjugate() * self.rest.rotation, self.rest.translation + moved)
            }
        };
        let now = figure.model(self.slot);
        let rotation = if self.rotation { rotation * self.rotation_offset } else { now.rotation };
        let position = if self.position { position + rotation * self.offset } else { now.translation };
        figure.keep(&self.left_behind);
        figure.turn_to(self.slot, rotation);
        figure.move_to(self.slot, position);
        figure.put_back(&self.left_behind);
    }

    /// The other joint's transform below its parent, below this joint's parent.
    fn beside(&self, figure: &mut Figure<'_>, side: PinSide) -> (DQuat, DVec3) {
        let parent = figure.parent(self.slot);
        let local = match side {
            PinSide::Target => figure.local(self.to),
            PinSide::Source => {
                let local = figure.source.local[self.to];
                Transform { translation: local.translation * self.local_scale, ..local }
            }
        };
        (parent.rotation * local.rotation, parent.transform_point(local.translation))
    }
}
