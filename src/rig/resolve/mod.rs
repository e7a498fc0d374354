//! From a spec and two rigs to a mapping in indices, and to the spec with everything found out filled in.

mod filled_in;
mod fk;
mod notes;
mod pairs;
mod pelvis;

use glam::DVec3;

use crate::model::{Axes, Clip, Reporter, Transform};

use self::{
    filled_in::filled_in,
    fk::{order_chains, resolve_fk},
    notes::{check_kinds, report_idle_limbs, report_rigs},
    pairs::find_pairs,
    pelvis::{resolve_pelvis, resolve_top},
};
use super::{
    align::align,
    anatomy::rides,
    error::{SpecError, SpecErrorKind},
    mapping::Mapping,
    spec::{Align, Carry, FkOp, Op, PelvisOp, RetargetSpec},
    understand::Rig,
};

/// What resolving gives.
#[derive(Clone, Debug)]
pub struct Resolved {
    /// What drives what.
    pub mapping: Mapping,
    /// The spec with everything found out filled in; resolved again, it gives the same mapping.
    pub spec: RetargetSpec,
}

/// Resolves a spec against two rigs and the clip that is to be moved.
///
/// # Errors
/// When the spec names what does not exist, a chain is not connected, or nothing can be mapped.
pub fn resolve(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    clip: &Clip,
    reporter: &mut Reporter,
) -> Result<Resolved, SpecError> {
    let ops = spec.ops.clone().unwrap_or_else(default_ops);
    check_kinds(spec, source, target)?;
    report_rigs(spec, source, target, reporter);
    let found = find_pairs(spec, source, target)?;
    let pairs = &found.pairs;
    let aligned = match spec.align {
        Align::Off => target.rest.clone(),
        Align::Auto | Align::Direction => align(source, target, pairs),
    };
    let carried = is_carried(&ops);
    let ours_from_plan = if carried { Axes::Z_UP_Y_FRONT.ours_from_this() } else { target.work_from_scene };
    let plan_from_source = Transform {
        translation: DVec3::ZERO,
        rotation: (ours_from_plan.conjugate() * source.work_from_scene).normalize(),
        scale: DVec3::splat(source.unit_metres / target.unit_metres),
    };
    let mut mapping = Mapping {
        source_rest: source.rest.clone(),
        target_hold: if carried { target.rest_local.clone() } else { target.skeleton().rest_pose() },
        target_rest: aligned,
        plan_from_source,
        plan_from_target: (ours_from_plan.conjugate() * target.work_from_scene).normalize(),
        pelvis: None,
        chains: Vec::new(),
        rides: Vec::new(),
        global_scale: 1.0,
    };
    let mut fields = Vec::new();
    for (index, op) in ops.iter().enumerate() {
        match op {
            Op::Pelvis(op) => match &found.tops {
                Some(tops) => resolve_top(op, tops, &mut mapping),
                None => resolve_pelvis(op, source, target, spec, clip, &mut mapping, reporter)?,
            },
            Op::Fk(op) => {
                let chains = resolve_fk(op, index, spec, pairs, source, target, &mut fields);
                mapping.chains.extend(chains);
            }
        }
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(error);
    }
    order_chains(&mut mapping.chains);
    if mapping.pelvis.is_none() && mapping.chains.is_empty() {
        return Err(nothing_to_map(source, target));
    }
    if !carried {
        // What the parents of chains that are carried along do is part of the chain.
        mapping.rides = rides(target);
    }
    report_idle_limbs(spec, source, target, &mapping, reporter);
    let spec = filled_in(spec, source, target, &found, ops);
    Ok(Resolved { mapping, spec })
}

fn default_ops() -> Vec<Op> {
    vec![Op::Pelvis(PelvisOp::default()), Op::Fk(FkOp::default())]
}

/// Whether chains are carried along by their parents, as ikrigretarget does it. Idle joints then keep the rest pose, as in that
/// program, and not their node transform.
fn is_carried(ops: &[Op]) -> bool {
    ops.iter().any(|op| matches!(op, Op::Fk(op) if op.enabled && op.carry == Carry::Parent))
}

pub(super) fn nothing_to_map(source: &Rig<'_>, target: &Rig<'_>) -> SpecError {
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
