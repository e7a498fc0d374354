//! From a spec and two rigs to a mapping in indices, and to the spec with everything found out filled in.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::model::{Axes, Clip, Reporter, Skeleton, Transform};

use super::{
    align::align,
    auto_map::{NamedPair, by_name, by_role, known_names, roles_of},
    error::{SpecError, SpecErrorKind, SpecField},
    floor::{Stance, clip_floor},
    mapping::{ChainPair, Chord, Drive, Mapping, PelvisPair, PelvisPosition},
    spec::{
        Align, Carry, ChainMap, FkOp, HeightRule, Op, PelvisOp, PelvisScale, PelvisScaleRule, RetargetSpec, RigSpec,
        ScaleOrigin,
    },
    understand::Rig,
};

/// ikrigretarget's guard: a source height below this counts as one.
const LEAST_HEIGHT: f64 = 1e-4;

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
    let pairs = find_pairs(spec, source, target)?;
    let aligned = match spec.align {
        Align::Off => target.rest.clone(),
        Align::Auto | Align::Direction => align(source, target, &pairs),
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
        global_scale: 1.0,
    };
    let mut fields = Vec::new();
    for (index, op) in ops.iter().enumerate() {
        match op {
            Op::Pelvis(op) => resolve_pelvis(op, source, target, spec, clip, &mut mapping, reporter)?,
            Op::Fk(op) => {
                let chains = resolve_fk(op, index, spec, &pairs, source, target, &mut fields);
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
    let spec = filled_in(spec, source, target, &pairs, ops);
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

/// The pairs of chains, each with joints on both sides.
fn find_pairs(spec: &RetargetSpec, source: &Rig<'_>, target: &Rig<'_>) -> Result<Vec<NamedPair>, SpecError> {
    let mut fields = Vec::new();
    let source_chains = explicit_chains(source, &spec.source, &mut fields);
    let target_chains = explicit_chains(target, &spec.target, &mut fields);
    let mut pairs = Vec::new();
    match &spec.map {
        Some(map) => {
            for (index, entry) in map.iter().enumerate() {
                pairs.extend(mapped_pairs(
                    entry,
                    index,
                    (source, &source_chains),
                    (target, &target_chains),
                    &mut fields,
                ));
            }
        }
        None => {
            for (name, joints) in &target_chains {
                if let Some(source_joints) = source_chains.get(name) {
                    pairs.push(NamedPair {
                        name: name.clone(),
                        source: source_joints.clone(),
                        target: joints.clone(),
                        role: None,
                    });
                }
            }
            let explicit: Vec<usize> = pairs.iter().flat_map(|pair| pair.target.iter().copied()).collect();
            let free = |pair: &NamedPair| pair.target.iter().all(|joint| !explicit.contains(joint));
            pairs.extend(by_role(source, target).into_iter().filter(free));
            let named = by_name(source, target, &pairs);
            pairs.extend(named);
        }
    }
    SpecError::from_fields(fields).map_or(Ok(pairs), Err)
}

fn explicit_chains(side: &Rig<'_>, spec: &RigSpec, fields: &mut Vec<SpecField>) -> BTreeMap<String, Vec<usize>> {
    let mut chains = BTreeMap::new();
    for (name, [start, end]) in &spec.chains {
        let pointer = format!("/{}/chains/{name}", side.name);
        let (first, last) = (side.joint(start, &format!("{pointer}/0")), side.joint(end, &format!("{pointer}/1")));
        match (first, last) {
            (Ok(first), Ok(last)) => match side.skeleton().path(first, last) {
                Some(path) => drop(chains.insert(name.clone(), path)),
                None => fields.push(SpecField::new(
                    SpecErrorKind::ChainNotConnected,
                    pointer,
                    format!("chain '{name}': '{end}' is not below '{start}' in the {} skeleton", side.name),
                )),
            },
            (first, last) => fields.extend([first.err(), last.err()].into_iter().flatten()),
        }
    }
    chains
}

type Chains = BTreeMap<String, Vec<usize>>;

fn mapped_pairs(
    entry: &ChainMap,
    index: usize,
    (source, source_chains): (&Rig<'_>, &Chains),
    (target, target_chains): (&Rig<'_>, &Chains),
    fields: &mut Vec<SpecField>,
) -> Vec<NamedPair> {
    let both_roles = !source_chains.contains_key(&entry.source) && !target_chains.contains_key(&entry.target);
    if both_roles {
        let (from, to) = (roles_of(&entry.source), roles_of(&entry.target));
        let complete = |side: &Rig<'_>, roles: &[&str]| roles.iter().all(|role| !side.role(role).is_empty());
        if from.len() == to.len() && complete(source, &from) && complete(target, &to) {
            let pair = |(from, to): (&str, &str)| NamedPair {
                name: to.to_owned(),
                source: source.role(from).to_vec(),
                target: target.role(to).to_vec(),
                role: (from == to).then(|| to.to_owned()),
            };
            return from.into_iter().zip(to).map(pair).collect();
        }
    }
    let mut joints_of = |side: &Rig<'_>, chains: &Chains, name: &str, end: &str| -> Option<Vec<usize>> {
        let from_roles = || {
            let joints: Vec<usize> = roles_of(name).iter().flat_map(|role| side.role(role).iter().copied()).collect();
            (!joints.is_empty()).then_some(joints)
        };
        let found = chains.get(name).cloned().or_else(from_roles);
        if found.is_none() {
            let mut known = known_names(side);
            known.extend(chains.keys().cloned());
            let pointer = format!("/map/{index}/{end}");
            let detail = format!("the {} rig has no chain and no role '{name}'", side.name);
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(name, known.iter().map(String::as_str)));
        }
        found
    };
    let source_joints = joints_of(source, source_chains, &entry.source, "source");
    let target_joints = joints_of(target, target_chains, &entry.target, "target");
    match (source_joints, target_joints) {
        (Some(source), Some(target)) => vec![NamedPair { name: entry.target.clone(), source, target, role: None }],
        _ => Vec::new(),
    }
}

fn resolve_fk(
    op: &FkOp,
    op_index: usize,
    spec: &RetargetSpec,
    pairs: &[NamedPair],
    source: &Rig<'_>,
    target: &Rig<'_>,
    fields: &mut Vec<SpecField>,
) -> Vec<ChainPair> {
    if !op.enabled {
        return Vec::new();
    }
    let mask: Option<Vec<&str>> = op.mask.as_ref().map(|names| names.iter().flat_map(|name| roles_of(name)).collect());
    for (index, name) in op.mask.iter().flatten().enumerate() {
        let known: Vec<String> = pairs.iter().map(|pair| pair.name.clone()).chain(known_names(target)).collect();
        let exists = known.iter().any(|known| known == name) || roles_of(name).len() > 1;
        if !exists {
            let detail = format!("there is no chain or role '{name}' to mask");
            let pointer = format!("/ops/{op_index}/mask/{index}");
            let field = SpecField::new(SpecErrorKind::UnknownName, pointer, detail);
            fields.push(field.with_nearest(name, known.iter().map(String::as_str)));
        }
    }
    let wanted = |pair: &&NamedPair| mask.as_ref().is_none_or(|mask| mask.contains(&pair.name.as_str()));
    pairs
        .iter()
        .filter(wanted)
        .map(|pair| {
            let entry = spec.map.iter().flatten().find(|entry| roles_of(&entry.target).contains(&pair.name.as_str()));
            ChainPair {
                name: pair.name.clone(),
                source: pair.source.clone(),
                target: pair.target.clone(),
                drive: Drive {
                    carry: op.carry,
                    rotation: entry.and_then(|entry| entry.rotation).unwrap_or(op.rotation),
                    translation: entry.and_then(|entry| entry.translation).unwrap_or(op.translation),
                    rotation_alpha: op.alpha
                        * entry.and_then(|entry| entry.rotation_alpha).unwrap_or(op.rotation_alpha),
                    translation_alpha: op.alpha
                        * entry.and_then(|entry| entry.translation_alpha).unwrap_or(op.translation_alpha),
                },
                chord: if spec.align == Align::Off { None } else { find_chord(pair, source, target) },
            }
        })
        .collect()
}

/// What a spine or a neck leads to, on both sides.
fn find_chord(pair: &NamedPair, source: &Rig<'_>, target: &Rig<'_>) -> Option<Chord> {
    let (ends, keeps_last): (&[&str], bool) = match pair.role.as_deref()? {
        "spine" => (&["neck", "head"], pair.target.len() > 1),
        "neck" => (&["head"], false),
        _ => return None,
    };
    let end = ends.iter().find(|end| !source.role(end).is_empty() && !target.role(end).is_empty())?;
    let (source_end, target_end) = (source.role(end)[0], target.role(end)[0]);
    let below = |rig: &Rig<'_>, chain: &[usize], end: usize| {
        let last = chain[chain.len() - 1];
        last != end && rig.skeleton().is_ancestor_or_self(last, end)
    };
    let connected = below(source, &pair.source, source_end) && below(target, &pair.target, target_end);
    connected.then_some(Chord { source_end, target_end, keeps_last })
}

/// Parents before children; ties by name, as ikrigretarget does it.
fn order_chains(chains: &mut [ChainPair]) {
    chains.sort_by(|first, second| (first.target[0], &first.name).cmp(&(second.target[0], &second.name)));
}

fn resolve_pelvis(
    op: &PelvisOp,
    source: &Rig<'_>,
    target: &Rig<'_>,
    spec: &RetargetSpec,
    clip: &Clip,
    mapping: &mut Mapping,
    reporter: &mut Reporter,
) -> Result<(), SpecError> {
    let joints = (source.role("pelvis").first().copied(), target.role("pelvis").first().copied());
    let (Some(source_pelvis), Some(target_pelvis)) = joints else {
        if op.enabled {
            let side = if joints.0.is_none() { "source" } else { "target" };
            reporter.warn(
                "pelvis_not_found",
                side,
                format!("no joint of the {side} was recognised as the pelvis; the pelvis op is left out"),
                format!("name the joint in {side}.root"),
            );
        }
        return Ok(());
    };
    let source_height = Height::measure(source, &spec.source, op.source_height, source_pelvis)?;
    let target_height = Height::measure(target, &spec.target, op.target_height, target_pelvis)?;
    let unit = mapping.plan_from_source.scale.x;
    let (source_value, target_value) = Height::comparable(&source_height, &target_height);
    let ratio = target_value / if source_value < LEAST_HEIGHT { 1.0 } else { source_value };
    mapping.global_scale = ratio / unit;
    if !op.enabled {
        return Ok(());
    }
    let scale = match op.scale {
        PelvisScale::Rule(PelvisScaleRule::Height) => mapping.global_scale,
        PelvisScale::Rule(PelvisScaleRule::None) => 1.0,
        PelvisScale::Value(value) => value,
    };
    let (source_origin, target_origin) = match op.origin {
        ScaleOrigin::Origin => (DVec3::ZERO, DVec3::ZERO),
        // Nothing says where the target's floor is, so it is where the source's is.
        ScaleOrigin::Floor if target_height.sole.is_none() => (DVec3::ZERO, DVec3::ZERO),
        ScaleOrigin::Floor => {
            let floor = if source_height.stands {
                source_height.floor
            } else {
                clip_floor(source, clip, source_pelvis, source_height.floor)
            };
            let up = mapping.plan_from_target * target.up();
            (up * floor * unit, up * target_height.floor)
        }
    };
    mapping.pelvis = Some(PelvisPair {
        source: source_pelvis,
        target: target_pelvis,
        rotation_alpha: op.alpha * op.rotation_alpha,
        translation_alpha: op.alpha * op.translation_alpha,
        position: PelvisPosition {
            ours_from_plan: (target.work_from_scene * mapping.plan_from_target.conjugate()).normalize(),
            scale: DVec3::new(op.scale_horizontal, op.scale_vertical, op.scale_horizontal) * scale,
            source_origin,
            target_origin,
        },
    });
    Ok(())
}

/// A pelvis height at rest, in the scene's unit.
struct Height {
    value: f64,
    floor: f64,
    /// As in [`Stance`].
    sole: Option<f64>,
    /// Whether the rest pose stands on the file's own floor, so that the floor of its clips is known too.
    stands: bool,
}

impl Height {
    fn measure(side: &Rig<'_>, spec: &RigSpec, rule: HeightRule, pelvis: usize) -> Result<Self, SpecError> {
        let ground = match &spec.ground {
            Some(name) if rule != HeightRule::AboveOrigin => {
                let joint = side.joint(name, &format!("/{}/ground", side.name)).map_err(|field| {
                    SpecError::from_fields(vec![field]).unwrap_or_else(|| nothing_to_map(side, side))
                })?;
                Some(side.rest_height(joint))
            }
            _ => None,
        };
        let stance = Stance::of(side, pelvis);
        let height = side.rest_height(pelvis);
        let stands = ground.is_none() && stance.sole.is_some();
        let as_asked = |value: f64, floor: f64| Self { value, floor, sole: Some(0.0), stands };
        Ok(match (rule, ground) {
            (HeightRule::AboveOrigin, _) => as_asked(height, stance.floor),
            (_, Some(floor)) => as_asked(height - floor, floor),
            (HeightRule::AboveGroundJoint, None) => as_asked(height - stance.floor, stance.floor),
            (HeightRule::AboveFloor, None) => {
                let Stance { floor, sole, height } = stance;
                Self { value: height, floor, sole, stands }
            }
        })
    }

    /// Both values above the same thing: the floor where both sides have one, else the lowest joint of the feet.
    fn comparable(source: &Self, target: &Self) -> (f64, f64) {
        match (source.sole, target.sole) {
            (Some(_), Some(_)) | (None, None) => (source.value, target.value),
            (source_sole, target_sole) => {
                (source.value - source_sole.unwrap_or(0.0), target.value - target_sole.unwrap_or(0.0))
            }
        }
    }
}

fn nothing_to_map(source: &Rig<'_>, target: &Rig<'_>) -> SpecError {
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

/// The spec with what was found out written in: roles, axes, units, ops.
fn filled_in(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
    pairs: &[NamedPair],
    ops: Vec<Op>,
) -> RetargetSpec {
    let map = spec.map.clone().or_else(|| {
        let entry = |pair: &NamedPair| ChainMap {
            source: pair.name.clone(),
            target: pair.name.clone(),
            rotation: None,
            translation: None,
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
    for pair in pairs.iter().filter(|pair| pair.role.is_none()) {
        let span = |skeleton: &Skeleton, joints: &[usize]| {
            [skeleton.label(joints[0]), skeleton.label(joints[joints.len() - 1])]
        };
        let name = || pair.name.clone();
        filled.source.chains.entry(name()).or_insert_with(|| span(source.skeleton(), &pair.source));
        filled.target.chains.entry(name()).or_insert_with(|| span(target.skeleton(), &pair.target));
    }
    filled
}

fn filled_in_side(spec: &RigSpec, side: &Rig<'_>) -> RigSpec {
    use super::spec::{OneOrMany, UnitSpec};
    let label = |joint: &usize| side.skeleton().label(*joint);
    let roles = side.roles.iter().map(|(role, joints)| {
        let names: Vec<String> = joints.iter().map(label).collect();
        (role.clone(), if names.len() == 1 { OneOrMany::One(names[0].clone()) } else { OneOrMany::Many(names) })
    });
    RigSpec {
        root: spec.root.clone(),
        roles: roles.collect(),
        // Only what an axis pair can say exactly; a body that stands askew is found again from the file.
        axes: (axes_are_exact(side)).then(|| side.axes.to_string()).or_else(|| spec.axes.clone()),
        unit: Some(UnitSpec::Metres(side.unit_metres)),
        ..spec.clone()
    }
}

fn axes_are_exact(side: &Rig<'_>) -> bool {
    side.axes.ours_from_this().dot(side.work_from_scene).abs() > 1.0 - 1e-12
}
