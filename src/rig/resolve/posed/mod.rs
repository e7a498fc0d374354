//! Which joints the ops are about that edit poses frame by frame.

mod additive_pose;
mod arms;
mod copy_base_pose;
mod fingers;
mod joints;
mod limits;
mod pin;
pub(super) mod props;
mod reach;
mod root_motion;
pub(super) mod shapes;
mod stretch;

use glam::{DQuat, EulerRot};

use super::super::{
    auto_map::roles_of,
    error::{SpecErrorKind, SpecField},
    floor::Stance,
    mapping::Mapping,
    rig::Rig,
    spec::{Alpha, Op, ScaleSourceOp, Scope},
    stages::{SourceScale, StagedKind},
};
use crate::model::{Clip, Reporter};

/// What the ops of this folder are resolved against.
pub(super) struct Subject<'a> {
    /// The op's place in the spec.
    pub(super) index: usize,
    pub(super) source: &'a Rig<'a>,
    pub(super) target: &'a Rig<'a>,
    /// The clip that is to be moved.
    pub(super) clip: &'a Clip,
    pub(super) mapping: &'a Mapping,
    pub(super) reporter: &'a mut Reporter,
    pub(super) fields: &'a mut Vec<SpecField>,
}

/// What an op does, where it is one of this folder's; nothing for the others, and for one that has nothing to do.
pub(super) fn resolve_posed(op: &Op, subject: &mut Subject<'_>) -> Option<StagedKind> {
    match op {
        Op::Joints(op) => Some(StagedKind::Posed(joints::resolve(op, subject))),
        Op::Pin(op) => Some(StagedKind::Posed(pin::resolve(op, subject))),
        Op::CopyBasePose(op) => Some(StagedKind::Posed(copy_base_pose::resolve(op, subject))),
        Op::AdditivePose(op) => Some(StagedKind::Posed(additive_pose::resolve(op, subject))),
        Op::ArmSpacing(op) => Some(StagedKind::Posed(arms::resolve(op, subject))),
        Op::StretchChain(op) => Some(StagedKind::Posed(stretch::resolve(op, subject))),
        Op::Limits(op) => Some(StagedKind::Posed(limits::resolve(op, subject))),
        Op::Twist(op) => {
            let masked = subject.masked(&op.scope);
            let all = || (0..subject.target.skeleton().len()).collect();
            Some(StagedKind::Twist(op.gain, masked.unwrap_or_else(all)))
        }
        Op::RootMotion(op) => root_motion::resolve(op, subject).map(StagedKind::RootMotion),
        Op::Reach(op) => Some(StagedKind::Posed(reach::resolve(op, subject))),
        Op::Fingers(op) => Some(StagedKind::Posed(fingers::resolve(op, subject))),
        Op::Stride(_)
        | Op::SelfContact(_)
        | Op::Props(_)
        | Op::ScaleSource(_)
        | Op::Pelvis(_)
        | Op::Fk(_)
        | Op::Contacts(_)
        | Op::Ik(_)
        | Op::Plant(_)
        | Op::Floor(_)
        | Op::Filter(_)
        | Op::Curves(_) => None,
    }
}

/// What the source is scaled by, on top of what an op before says.
pub(super) fn scale_source(
    op: &ScaleSourceOp,
    index: usize,
    source: &Rig<'_>,
    before: Option<SourceScale>,
    fields: &mut Vec<SpecField>,
) -> Option<SourceScale> {
    if !op.scope.enabled {
        return before;
    }
    let mut refuse = |place: &str, detail: &str| {
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("/ops/{index}/{place}"), detail));
    };
    if op.scope.mask.is_some() || op.scope.frames.is_some() || op.scope.alpha != Alpha::ALL {
        refuse("", "scale_source is about the whole clip: it has no alpha, mask and frames");
    }
    if before.is_some() {
        refuse("", "the source is scaled once; there is a scale_source before this one");
    }
    let pivot = op.pivot.as_ref().and_then(|name| match source.joint(name, &format!("/ops/{index}/pivot")) {
        Ok(joint) => Some(joint),
        Err(field) => {
            let role = source.role(name).first().copied();
            if role.is_none() {
                fields.push(field);
            }
            role
        }
    });
    Some(SourceScale { factor: op.factor, pivot, up: source.up(), floor: floor_of(source).filter(|_| op.on_floor) })
}

/// Height of the floor below a rig, in the scene's unit.
fn floor_of(rig: &Rig<'_>) -> Option<f64> {
    let pelvis = *rig.role("pelvis").first()?;
    Some(Stance::of(rig, pelvis).floor)
}

impl Subject<'_> {
    fn pointer(&self, rest: &str) -> String {
        format!("/ops/{}/{rest}", self.index)
    }

    /// The joint of that name, or the first of that role. Tells where there is neither.
    fn joint(&mut self, side: &Rig<'_>, name: &str, place: &str) -> Option<usize> {
        let pointer = self.pointer(place);
        match side.joint(name, &pointer) {
            Ok(joint) => Some(joint),
            Err(field) => {
                let role = side.role(name).first().copied();
                if role.is_none() {
                    self.fields.push(field);
                }
                role
            }
        }
    }

    fn target_joint(&mut self, name: &str, place: &str) -> Option<usize> {
        self.joint(self.target, name, place)
    }

    fn source_joint(&mut self, name: &str, place: &str) -> Option<usize> {
        self.joint(self.source, name, place)
    }

    /// All target joints of a name: a limb, a chain, a role or a joint. Tells where there is none.
    fn joints_named(&mut self, name: &str, place: &str) -> Vec<usize> {
        let of_roles: Vec<usize> =
            roles_of(name).into_iter().flat_map(|role| self.target.role(role).iter().copied()).collect();
        if !of_roles.is_empty() {
            return of_roles;
        }
        if let Some(chain) = self.mapping.chains.iter().find(|chain| chain.name == name) {
            return chain.target.clone();
        }
        self.target_joint(name, place).into_iter().collect()
    }

    /// The joints of the target that the mask names; nothing where there is no mask.
    fn masked(&mut self, scope: &Scope) -> Option<Vec<usize>> {
        let mask = scope.mask.as_ref()?;
        let joints = mask.iter().enumerate().flat_map(|(position, name)| {
            let found = self.joints_named(name, &format!("mask/{position}"));
            found.into_iter()
        });
        Some(joints.collect())
    }

    fn refuse(&mut self, place: &str, detail: String) {
        self.fields.push(SpecField::new(SpecErrorKind::InvalidValue, self.pointer(place), detail));
    }
}

/// Whether an op's mask lets it at a joint.
fn is_in(masked: Option<&Vec<usize>>, joint: usize) -> bool {
    masked.is_none_or(|masked| masked.contains(&joint))
}

/// A rotation from degrees about X, then Y, then Z, each about the axes as the one before left them.
fn turn(degrees: [f64; 3]) -> DQuat {
    let [x, y, z] = degrees.map(f64::to_radians);
    DQuat::from_euler(EulerRot::XYZ, x, y, z)
}
