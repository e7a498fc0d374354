//! A joint that follows another.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{Pin, PinMode, PinOp, PinSide};

use glam::{DMat3, DQuat, DVec3};

use crate::model::Transform;

use crate::retarget::stages::posed::figure::Figure;

/// One pin.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct PinStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) to: usize,
    pub(in crate::retarget) side: PinSide,
    pub(in crate::retarget) mode: PinMode,
    pub(in crate::retarget) position: bool,
    pub(in crate::retarget) rotation: bool,
    /// In plan units.
    pub(in crate::retarget) offset: DVec3,
    pub(in crate::retarget) rotation_offset: DQuat,
    /// The rest poses of both joints in plan space.
    pub(in crate::retarget) rest: Transform,
    pub(in crate::retarget) to_rest: Transform,
    /// What a displacement of the source becomes, and what is added to it.
    pub(in crate::retarget) travel: DMat3,
    pub(in crate::retarget) raised: DVec3,
    /// Factor on lengths below a parent of the source.
    pub(in crate::retarget) local_scale: f64,
    /// Joints below that stay where they are.
    pub(in crate::retarget) left_behind: Vec<usize>,
}

impl PinStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
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
