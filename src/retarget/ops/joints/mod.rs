//! A row of a joint table.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{JointRow, JointSource, JointSpace, JointsOp};

use glam::{DMat3, DQuat, DVec3};

use crate::model::Transform;

use crate::retarget::stages::{
    posed::figure::{Figure, scaled},
    two_bone::arc,
};

/// One row. Spaces and formulas are those of the op.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct JointStep {
    pub(in crate::retarget) slot: usize,
    pub(in crate::retarget) space: JointSpace,
    pub(in crate::retarget) follows: Follows,
    pub(in crate::retarget) rotation_gain: Option<f64>,
    /// About the joint's own axes.
    pub(in crate::retarget) rotation_offset: DQuat,
    /// `A · M · A⁻¹` in the space in which changes are measured: takes a vector of the source to the target's.
    pub(in crate::retarget) change: Mapped,
    /// The rest pose of the target's joint: in plan space, and below its parent.
    pub(in crate::retarget) rest: Transform,
    pub(in crate::retarget) rest_local: Transform,
    pub(in crate::retarget) position: Option<PositionStep>,
}

/// What a row follows.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) enum Follows {
    /// A source joint; its rest in plan space and below its parent.
    Joint { source: usize, rest: Transform, rest_local: Transform },
    /// The line between two source joints; the bone of the target in its joint's own axes.
    Pair { points: [usize; 2], bone: DVec3 },
}

/// How vectors are carried over: displacements, and the axes of rotations.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct Mapped {
    /// From the space of the change to the axes that the table counts in.
    pub(in crate::retarget) axes_from_space: DQuat,
    pub(in crate::retarget) order: DMat3,
    pub(in crate::retarget) offset: DQuat,
}

impl Mapped {
    fn vector(&self, vector: DVec3) -> DVec3 {
        self.axes_from_space.conjugate() * (self.offset * (self.order * (self.axes_from_space * vector)))
    }

    fn rotation(&self, rotation: DQuat, gain: f64) -> DQuat {
        let short = if rotation.w < 0.0 { -rotation } else { rotation };
        DQuat::from_scaled_axis(self.vector(short.to_scaled_axis()) * gain)
    }
}

/// How a row moves a joint.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PositionStep {
    /// What a displacement of the source becomes: the pelvis scale and the gain, in the space of the change.
    pub(in crate::retarget) travel: DMat3,
    /// What is added: the offset, and how much higher the floors are.
    pub(in crate::retarget) offset: DVec3,
    /// What is taken off the source's displacement: how much higher its clip's floor is than its rest pose's.
    pub(in crate::retarget) source_floor: DVec3,
}

impl JointStep {
    pub(in crate::retarget) fn apply(&self, figure: &mut Figure<'_>) {
        match self.follows {
            Follows::Joint { source, rest, rest_local } => {
                let pose = figure.source;
                match self.space {
                    JointSpace::Model => self.follow_in_model(figure, &pose.model[source], &rest),
                    JointSpace::Local => self.follow_in_local(figure, &pose.local[source], &rest_local),
                }
            }
            Follows::Pair { points: [first, second], bone } => {
                let [first, second] = [first, second].map(|slot| figure.source.model[slot].translation);
                self.point_along(figure, first, second, bone);
            }
        }
    }

    fn follow_in_model(&self, figure: &mut Figure<'_>, now: &Transform, rest: &Transform) {
        if let Some(gain) = self.rotation_gain {
            let delta = self.change.rotation(now.rotation * rest.rotation.conjugate(), gain);
            figure.turn_to(self.slot, delta * self.rest.rotation * self.rotation_offset);
        }
        if let Some(position) = &self.position {
            let moved =
                position.travel * (self.change.vector(now.translation - rest.translation) - position.source_floor);
            figure.move_to(self.slot, self.rest.translation + moved + position.offset);
        }
    }

    fn follow_in_local(&self, figure: &mut Figure<'_>, now: &Transform, rest: &Transform) {
        let mut local = figure.local(self.slot);
        if let Some(gain) = self.rotation_gain {
            let delta = self.change.rotation(rest.rotation.conjugate() * now.rotation, gain);
            local.rotation = (self.rest_local.rotation * delta * self.rotation_offset).normalize();
        }
        if let Some(position) = &self.position {
            let moved = position.travel * self.change.vector(now.translation - rest.translation);
            local.translation = self.rest_local.translation + moved + position.offset;
        }
        figure.set_local(self.slot, local);
    }

    /// The bone hangs from its parent as at rest and is turned the shortest way until it points along the line. A line without
    /// length leaves it there.
    fn point_along(&self, figure: &mut Figure<'_>, first: DVec3, second: DVec3, bone: DVec3) {
        let above = figure.parent(self.slot);
        if let Some(gain) = self.rotation_gain {
            let carried = above.rotation * self.rest_local.rotation;
            let wanted = self.change.vector(second - first);
            let side = carried * bone.any_orthogonal_vector().normalize_or(DVec3::X);
            let turn = scaled(arc(carried * bone, wanted, side), gain);
            figure.turn_to(self.slot, turn * carried * self.rotation_offset);
        }
        if let Some(position) = &self.position {
            figure.move_to(self.slot, position.travel * (first - position.source_floor) + position.offset);
        }
    }
}
