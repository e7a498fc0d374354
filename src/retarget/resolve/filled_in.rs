//! The spec with everything that was found out written in.

use crate::model::Skeleton;

use super::pairs::Found;
use crate::{
    retarget::{
        mapping::Mapping,
        ops::{Op, PelvisScale, PelvisScaleRule, ScaleOrigin},
        spec::{ChainMap, RetargetSpec, TranslationMode},
    },
    rig::{RigSpec, named_pair::NamedPair, rig::Rig},
};

/// The spec with what was found out written in: roles, axes, units, ops.
pub(in crate::retarget) fn filled_in(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    found: &Found,
    mapping: &Mapping,
    ops: Vec<Op>,
) -> RetargetSpec {
    let Found { pairs, tops } = found;
    let map = spec.map.clone().or_else(|| {
        let entry = |pair: &NamedPair| ChainMap {
            source: pair.source_name.clone(),
            target: pair.name.clone(),
            also: pair.also.iter().map(|(name, _)| name.clone()).collect(),
            rotation: None,
            translation: tops.as_ref().and_then(|_| slide(mapping, pair)),
            rotation_alpha: None,
            translation_alpha: None,
        };
        Some(pairs.iter().map(entry).collect())
    });
    let mut filled = RetargetSpec {
        version: Some(1),
        map,
        ops: Some(ops),
        source: filled_in_side(&spec.source, source),
        target: filled_in_side(&spec.target, target),
        ..spec.clone()
    };
    if let Some(tops) = tops {
        filled.source.root = Some(source.skeleton().label(tops.source));
        filled.target.root = Some(target.skeleton().label(tops.target));
        for op in filled.ops.iter_mut().flatten() {
            if let Op::Pelvis(op) = op {
                let factor = tops.size_ratio * target.unit_meters / source.unit_meters;
                op.origin = ScaleOrigin::Origin;
                if matches!(op.scale, PelvisScale::Rule(rule) if rule != PelvisScaleRule::None) {
                    op.scale = PelvisScale::Value(factor);
                }
            }
        }
    }
    for pair in pairs.iter().filter(|pair| pair.role.is_none()) {
        let span = |skeleton: &Skeleton, joints: &[usize]| {
            [skeleton.label(joints[0]), skeleton.label(joints[joints.len() - 1])]
        };
        let chain = |pair: &NamedPair| span(source.skeleton(), &pair.source);
        filled.source.chains.entry(pair.source_name.clone()).or_insert_with(|| chain(pair));
        filled.target.chains.entry(pair.name.clone()).or_insert_with(|| span(target.skeleton(), &pair.target));
    }
    filled
}

/// How a pair's joint slides, where it does.
fn slide(mapping: &Mapping, pair: &NamedPair) -> Option<TranslationMode> {
    let chain = mapping.chains.iter().find(|chain| chain.target == pair.target)?;
    Some(chain.drive.translation).filter(|translation| *translation != TranslationMode::None)
}

fn filled_in_side(spec: &RigSpec, side: &Rig<'_>) -> RigSpec {
    use crate::rig::{OneOrMany, UnitSpec};
    let label = |joint: &usize| side.skeleton().label(*joint);
    let roles = side.roles.iter().map(|(role, joints)| {
        let names: Vec<String> = joints.iter().map(label).collect();
        (role.clone(), if names.len() == 1 { OneOrMany::One(names[0].clone()) } else { OneOrMany::Many(names) })
    });
    RigSpec {
        root: spec.root.clone(),
        rest: side.rest_spec.clone(),
        roles: roles.collect(),
        // Only what an axis pair can say exactly; a body that stands askew is found again from the file.
        axes: (axes_are_exact(side)).then(|| side.axes.to_string()).or_else(|| spec.axes.clone()),
        unit: Some(UnitSpec::Meters(side.unit_meters)),
        ..spec.clone()
    }
}

fn axes_are_exact(side: &Rig<'_>) -> bool {
    side.axes.canonical_from_this().dot(side.canonical_from_scene).abs() > 1.0 - 1e-12
}
