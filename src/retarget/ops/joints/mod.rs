//! A row of a joint table.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{JointRow, JointSource, JointSpace, JointsOp};

use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
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

impl Step for JointStep {
    fn apply(&self, figure: &mut Figure<'_>) {
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
}

/// What a row of a joint table does.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct JointDrive {
    /// What is followed.
    pub(in crate::retarget) from: DriveFrom,
    /// The target joint.
    pub(in crate::retarget) joint: usize,
    /// In which space changes are measured.
    pub(in crate::retarget) space: JointSpace,
    /// Factor on the displacement; nothing where the position does not follow.
    pub(in crate::retarget) position_gain: Option<f64>,
    /// Factor on the angle; nothing where the rotation does not follow.
    pub(in crate::retarget) rotation_gain: Option<f64>,
    /// Meters.
    pub(in crate::retarget) position_offset: DVec3,
    /// About the joint's own axes.
    pub(in crate::retarget) rotation_offset: DQuat,
    /// From the source's components of a vector to the target's: each row and each column has one ±1.
    pub(in crate::retarget) axis_order: DMat3,
    /// Turns a change before it is applied.
    pub(in crate::retarget) axis_offset: DQuat,
}

/// What a row follows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::retarget) enum DriveFrom {
    /// A source joint.
    Joint(usize),
    /// The line between two.
    Pair {
        /// Where the line begins and ends, joints of the source.
        points: [usize; 2],
        /// The target joint that the bone leads to.
        end: usize,
    },
}

impl Edit for JointDrive {
    type Step = JointStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> JointStep {
        let rest = builder.stack.target_rest[self.joint];
        let rest_local = builder.rest_below_parent(self.joint);
        let slot = builder.change(self.joint, self.rotation_gain.is_some(), self.position_gain.is_some());
        let follows = match self.from {
            DriveFrom::Joint(joint) => Follows::Joint {
                source: builder.source(joint),
                rest: builder.stack.source_rest[joint],
                rest_local: builder.stack.mapping.source_rest.to_local(builder.stack.source).transforms()[joint],
            },
            DriveFrom::Pair { points: [first, second], end } => {
                let end = builder.stack.target_rest[end].translation;
                let bone = rest.rotation.conjugate() * (end - rest.translation);
                Follows::Pair { points: [builder.source(first), builder.source(second)], bone }
            }
        };
        let axes_from_space = match (self.space, self.from) {
            (JointSpace::Local, DriveFrom::Joint(_)) => DQuat::IDENTITY,
            _ => DQuat::from_mat3(&builder.stack.ground().axes()).conjugate(),
        };
        let change = Mapped { axes_from_space, order: self.axis_order, offset: self.axis_offset };
        JointStep {
            slot,
            space: self.space,
            follows,
            rotation_gain: self.rotation_gain,
            rotation_offset: self.rotation_offset,
            change,
            rest,
            rest_local,
            position: self.position_gain.map(|gain| self.position(builder, gain)),
        }
    }
}

impl OpSpec for JointsOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}

impl JointDrive {
    fn position(&self, builder: &StepBuilder<'_>, gain: f64) -> PositionStep {
        let ground = builder.stack.ground();
        let meters = self.position_offset * ground.units_per_meter;
        let (raised, source_raised) = builder.floors();
        match (self.from, self.space) {
            (DriveFrom::Pair { .. }, _) => PositionStep {
                travel: ground.travel * gain,
                offset: ground.axes() * meters + ground.up * ground.target_floor,
                source_floor: ground.up * ground.source_floor,
            },
            (DriveFrom::Joint(_), JointSpace::Model) => PositionStep {
                travel: ground.travel * gain,
                offset: ground.axes() * meters + raised,
                source_floor: source_raised,
            },
            (DriveFrom::Joint(joint), JointSpace::Local) => {
                let scale = |rest: &[Transform], parent: Option<usize>, above: f64| {
                    parent.map_or(DVec3::splat(above), |parent| rest[parent].scale)
                };
                let stack = builder.stack;
                let source =
                    scale(&stack.source_rest, stack.source.parent(joint), stack.mapping.plan_from_source.scale.x);
                let target = scale(&stack.target_rest, stack.target.parent(self.joint), 1.0);
                let unit = Transform { scale: target, ..Transform::IDENTITY };
                let into_target = |vector: DVec3| unit.relative(&Transform::from_translation(vector)).translation;
                let factor = into_target(source * stack.mapping.global_scale * gain);
                PositionStep {
                    travel: DMat3::from_diagonal(factor),
                    offset: into_target(meters),
                    source_floor: DVec3::ZERO,
                }
            }
        }
    }
}
