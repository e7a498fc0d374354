//! What the ops of a spec become for two rigs.

use glam::{DMat3, DVec3};

use super::limbs::find_limbs;
use crate::{
    model::{Clip, Reporter},
    retarget::{
        mapping::{ChainPair, Ground, Mapping},
        ops::{Op, context::Context, resolved::ResolvedOps},
    },
    rig::{
        error::SpecError,
        floor::{Stance, clip_floor},
        rig::Rig,
    },
};

/// Resolves the ops behind `pelvis` and `fk`, and what those two do behind the plan. `kinematics` are the chains of each `fk` op by
/// its index. Needs the rest of the mapping, and puts ground and limbs into it where an op needs them.
pub(in crate::retarget) fn resolve_ops(
    ops: &[Op],
    kinematics: &[(usize, Vec<ChainPair>)],
    [source, target]: [&Rig<'_>; 2],
    clip: &Clip,
    mapping: &mut Mapping,
    reporter: &mut Reporter,
) -> Result<ResolvedOps, SpecError> {
    let limbs = find_limbs(source, target, clip);
    let (mut front, mut resolved, mut fields) = (Vec::new(), ResolvedOps::default(), Vec::new());
    for (index, op) in ops.iter().enumerate() {
        op.resolve(&mut Context {
            name: op.name(),
            index,
            source,
            target,
            clip,
            mapping,
            limbs: &limbs,
            chains: kinematics.iter().find(|entry| entry.0 == index).map_or(&[][..], |entry| &entry.1),
            reporter,
            fields: &mut fields,
            front: &mut front,
            resolved: &mut resolved,
        });
    }
    if let Some(error) = SpecError::from_fields(fields) {
        return Err(error);
    }
    report_order(ops, reporter);
    for (index, op) in resolved.ops.iter().enumerate() {
        op.work.report(op, &resolved.ops[..index], &limbs, reporter);
    }
    front.append(&mut resolved.ops);
    resolved.ops = front;
    if !resolved.ops.is_empty() {
        mapping.ground = ground(source, target, clip, mapping);
        mapping.limbs = limbs;
    }
    Ok(resolved)
}

/// Tells where an op does not run where it stands.
fn report_order(ops: &[Op], reporter: &mut Reporter) {
    let is_kinematic = |op: &Op| match op {
        Op::Pelvis(op) => op.enabled,
        Op::Fk(op) => op.enabled,
        _ => false,
    };
    let kinematics_end = ops.iter().rposition(is_kinematic).unwrap_or(0);
    for (index, _) in ops[..kinematics_end].iter().enumerate().filter(|(_, op)| op.changes_poses()) {
        reporter.warn(
            "op_runs_behind_kinematics",
            format!("/ops/{index}"),
            "the op stands before a pelvis or fk op, and those run before all others; it runs behind them",
            "put pelvis and fk first, as they run",
        );
    }
}
fn ground(source: &Rig<'_>, target: &Rig<'_>, clip: &Clip, mapping: &Mapping) -> Ground {
    let up = mapping.plan_from_target * target.up();
    let front = mapping.plan_from_target * (target.canonical_from_scene.conjugate() * DVec3::Z);
    let unit = mapping.plan_from_source.scale.x;
    let stance = |side: &Rig<'_>| side.role("pelvis").first().map(|&pelvis| (pelvis, Stance::of(side, pelvis)));
    let (mut source_rest_floor, mut source_floor) = (0.0, 0.0);
    if let Some((pelvis, stance)) = stance(source) {
        let floor =
            if stance.sole.is_some() { stance.floor } else { clip_floor(source, clip, pelvis, stance.floor).height };
        (source_rest_floor, source_floor) = (stance.floor * unit, floor * unit);
    }
    let target_rest_floor = stance(target).map_or(0.0, |(_, stance)| stance.floor);
    let (travel, target_floor) = match &mapping.pelvis {
        Some(pelvis) => {
            // The floor does not sink with a pelvis that is offset.
            let travel = |scale: DVec3| {
                let turn = DMat3::from_quat(pelvis.plain.canonical_from_plan);
                turn.transpose() * DMat3::from_diagonal(scale) * turn
            };
            let away = up * (source_floor - pelvis.plain.source_sole) - pelvis.plain.source_origin;
            let floor = pelvis.plain.target_origin + travel(pelvis.plain.scale) * away;
            (travel(pelvis.position.scale), floor.dot(up))
        }
        None => (DMat3::from_diagonal(DVec3::splat(mapping.global_scale)), target_rest_floor),
    };
    Ground {
        up,
        front,
        units_per_meter: target.unit_meters.recip(),
        travel,
        source_rest_floor,
        source_floor,
        target_rest_floor,
        target_floor,
    }
}
