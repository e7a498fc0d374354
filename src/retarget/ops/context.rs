//! What ops are resolved against, and where what they become goes.

use glam::{DQuat, EulerRot};

use super::{
    Alpha, Scope,
    resolved::{OpWork, ResolvedOp, ResolvedOps},
    schedule::{Schedule, schedule},
};
use crate::model::{Clip, Reporter};
use crate::rig::Limb;
use crate::{
    retarget::mapping::{ChainPair, LimbPair, Mapping},
    rig::{
        auto_map::roles_of,
        error::{SpecError, SpecErrorKind, SpecField},
        rig::Rig,
    },
};

/// What the ops of this folder are resolved against.
pub(in crate::retarget) struct Context<'a> {
    /// The op's name on the wire.
    pub(in crate::retarget) name: &'static str,
    /// The op's place in the spec.
    pub(in crate::retarget) index: usize,
    pub(in crate::retarget) source: &'a Rig<'a>,
    pub(in crate::retarget) target: &'a Rig<'a>,
    /// The clip that is to be moved.
    pub(in crate::retarget) clip: &'a Clip,
    pub(in crate::retarget) mapping: &'a Mapping,
    pub(in crate::retarget) limbs: &'a [LimbPair],
    /// The chains of an `fk` op.
    pub(in crate::retarget) chains: &'a [ChainPair],
    pub(in crate::retarget) reporter: &'a mut Reporter,
    pub(in crate::retarget) fields: &'a mut Vec<SpecField>,
    /// What `pelvis` and `fk` do behind the plan, which is done before all else.
    pub(in crate::retarget) front: &'a mut Vec<ResolvedOp>,
    /// What the ops before this one have become.
    pub(in crate::retarget) resolved: &'a mut ResolvedOps,
}

/// Which limbs an op is about when its mask does not say.
#[derive(Clone, Copy)]
pub(in crate::retarget) enum Limbs {
    All,
    Legs,
    Arms,
}

impl Context<'_> {
    /// Adds what the op becomes.
    pub(in crate::retarget) fn push(&mut self, scope: &Scope, work: impl OpWork + 'static) {
        let schedule = self.schedule(scope);
        self.resolved.ops.push(ResolvedOp::new(self.name, schedule, Vec::new(), work));
    }

    /// Adds what an op of limbs becomes; `defaults` are its limbs where it has no mask.
    pub(in crate::retarget) fn push_on_limbs(&mut self, scope: &Scope, defaults: Limbs, work: impl OpWork + 'static) {
        let schedule = self.schedule(scope);
        let limbs = self.masked_limbs(scope, defaults);
        self.resolved.ops.push(ResolvedOp::new(self.name, schedule, limbs, work));
    }

    /// Adds what `pelvis` or `fk` does behind the plan.
    pub(in crate::retarget) fn push_front(&mut self, schedule: Schedule, work: impl OpWork + 'static) {
        self.front.push(ResolvedOp::new(self.name, schedule, Vec::new(), work));
    }

    /// When an op works, and how much.
    pub(in crate::retarget) fn schedule(&mut self, scope: &Scope) -> Schedule {
        self.schedule_of(&scope.alpha, scope.frames)
    }

    /// When `pelvis` or `fk` is faded behind the plan; nothing where the plan's own alpha says it all.
    pub(in crate::retarget) fn fade(&mut self, alpha: &Alpha, frames: Option<[usize; 2]>) -> Option<Schedule> {
        let is_constant = frames.is_none() && alpha.constant().is_some();
        (!is_constant).then(|| self.schedule_of(alpha, frames))
    }

    fn schedule_of(&mut self, alpha: &Alpha, frames: Option<[usize; 2]>) -> Schedule {
        schedule(alpha, frames, &format!("/ops/{}", self.index), self.source.scene, self.clip, self.fields)
    }

    fn masked_limbs(&mut self, scope: &Scope, defaults: Limbs) -> Vec<usize> {
        let names =
            |limb: &Limb| [limb.name()].into_iter().chain(limb.contact_points()).filter(|name| !name.is_empty());
        let known: Vec<&str> = Limb::all().flat_map(|limb| names(&limb).collect::<Vec<&str>>()).collect();
        for (position, name) in scope.mask.iter().flatten().enumerate() {
            if !known.contains(&name.as_str()) {
                let detail = format!("there is no limb '{name}' to mask");
                let pointer = format!("/ops/{}/mask/{position}", self.index);
                let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
                self.fields.push(field.with_nearest(name, known.iter().copied()));
            }
        }
        let wanted = |pair: &LimbPair| match &scope.mask {
            None => match defaults {
                Limbs::All => true,
                Limbs::Legs => pair.limb.is_leg(),
                Limbs::Arms => !pair.limb.is_leg(),
            },
            Some(masked) => names(&pair.limb).any(|name| masked.iter().any(|masked| masked == name)),
        };
        (0..self.limbs.len()).filter(|&index| wanted(&self.limbs[index])).collect()
    }

    pub(in crate::retarget) fn pointer(&self, rest: &str) -> String {
        format!("/ops/{}/{rest}", self.index)
    }

    /// The joint of that name, or the first of that role. Tells where there is neither.
    pub(in crate::retarget) fn joint(&mut self, side: &Rig<'_>, name: &str, place: &str) -> Option<usize> {
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

    pub(in crate::retarget) fn target_joint(&mut self, name: &str, place: &str) -> Option<usize> {
        self.joint(self.target, name, place)
    }

    pub(in crate::retarget) fn source_joint(&mut self, name: &str, place: &str) -> Option<usize> {
        self.joint(self.source, name, place)
    }

    /// All target joints of a name: a limb, a chain, a role or a joint. Tells where there is none.
    pub(in crate::retarget) fn joints_named(&mut self, name: &str, place: &str) -> Vec<usize> {
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
    pub(in crate::retarget) fn masked(&mut self, scope: &Scope) -> Option<Vec<usize>> {
        let mask = scope.mask.as_ref()?;
        let joints = mask.iter().enumerate().flat_map(|(position, name)| {
            let found = self.joints_named(name, &format!("mask/{position}"));
            found.into_iter()
        });
        Some(joints.collect())
    }

    pub(in crate::retarget) fn refuse(&mut self, place: &str, detail: String) {
        self.fields.push(SpecField::new(SpecErrorKind::InvalidValue, self.pointer(place), detail));
    }
}

/// Whether an op's mask lets it at a joint.
pub(in crate::retarget) fn is_in(masked: Option<&Vec<usize>>, joint: usize) -> bool {
    masked.is_none_or(|masked| masked.contains(&joint))
}

/// A rotation from degrees about X, then Y, then Z, each about the axes as the one before left them.
pub(in crate::retarget) fn turn(degrees: [f64; 3]) -> DQuat {
    let [x, y, z] = degrees.map(f64::to_radians);
    DQuat::from_euler(EulerRot::XYZ, x, y, z)
}

/// Two rigs of which nothing corresponds.
pub(in crate::retarget) fn nothing_to_map(source: &Rig<'_>, target: &Rig<'_>) -> SpecError {
    let describe = |side: &Rig<'_>| {
        let kind = side.recognition.recognised_as.clone().unwrap_or_else(|| "no known rig".into());
        format!("{} ({} joints, {kind}, {} roles)", side.name, side.skeleton().len(), side.roles.len())
    };
    SpecError::new(
        SpecErrorKind::NothingToMap,
        format!("nothing of the {} corresponds to anything of the {}", describe(source), describe(target)),
        "name the joints: source.roles and target.roles, or source.chains and target.chains with equal names",
    )
}
