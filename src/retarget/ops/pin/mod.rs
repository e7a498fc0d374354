//! A joint that follows another.

pub(in crate::retarget) mod resolve;
pub(in crate::retarget) mod spec;

pub use self::spec::{Pin, PinMode, PinOp, PinSide};

use crate::retarget::stages::posed::Step;
use crate::retarget::{
    mapping::Mapping,
    ops::{context::Context, edit::Edit, op_spec::OpSpec, scope::Scope},
    stages::posed::builder::StepBuilder,
};
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

impl Step for PinStep {
    fn apply(&self, figure: &mut Figure<'_>) {
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
}

/// What a pin does.
#[derive(Clone, Copy, Debug)]
pub(in crate::retarget) struct PinDrive {
    /// The joint that follows.
    pub(in crate::retarget) joint: usize,
    /// The joint that it follows, of that side.
    pub(in crate::retarget) to: usize,
    /// Whose it is.
    pub(in crate::retarget) side: PinSide,
    /// How.
    pub(in crate::retarget) mode: PinMode,
    /// Whether the position follows.
    pub(in crate::retarget) position: bool,
    /// Whether the rotation follows.
    pub(in crate::retarget) rotation: bool,
    /// Meters along the joint's own axes.
    pub(in crate::retarget) offset: DVec3,
    /// About its own axes.
    pub(in crate::retarget) rotation_offset: DQuat,
    /// Whether joints below it are carried along.
    pub(in crate::retarget) carries_children: bool,
}

impl Edit for PinDrive {
    type Step = PinStep;

    fn joints(&self, _mapping: &Mapping) -> Vec<usize> {
        vec![self.joint]
    }

    fn step(&self, builder: &mut StepBuilder<'_>) -> PinStep {
        let stack = builder.stack;
        let ground = stack.ground();
        let left_behind = if self.carries_children { Vec::new() } else { builder.driven_below(self.joint) };
        let slot = builder.change(self.joint, self.rotation, self.position);
        let (to, to_rest) = match self.side {
            PinSide::Source => (builder.source(self.to), stack.source_rest[self.to]),
            PinSide::Target => (builder.target(self.to), stack.target_rest[self.to]),
        };
        let (raised, source_raised) = builder.floors();
        let rest = match (self.mode, self.side) {
            // Joints that nothing drives keep the file's own pose, so that is where the offset is taken from.
            (PinMode::KeepOffset, PinSide::Target) => {
                let hold = stack.mapping.target_hold.to_model(stack.target);
                let model = |joint: usize| stack.plan_from_target.then_child(&hold.transforms()[joint]);
                to_rest.then_child(&model(self.to).relative(&model(self.joint)))
            }
            _ => stack.target_rest[self.joint],
        };
        PinStep {
            slot,
            to,
            side: self.side,
            mode: self.mode,
            position: self.position,
            rotation: self.rotation,
            offset: self.offset * ground.units_per_meter,
            rotation_offset: self.rotation_offset,
            rest,
            to_rest,
            travel: ground.travel,
            raised: raised - ground.travel * source_raised,
            local_scale: stack.mapping.plan_from_source.scale.x * stack.mapping.global_scale,
            left_behind,
        }
    }
}

impl OpSpec for PinOp {
    fn scope(&self) -> Option<&Scope> {
        Some(&self.scope)
    }

    fn resolve(&self, context: &mut Context<'_>) {
        let edits = resolve::resolve(self, context);
        context.push(&self.scope, edits);
    }
}
