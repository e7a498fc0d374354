//! Which chains of the two rigs belong together.

use std::collections::BTreeMap;

use crate::{
    retarget::spec::{ChainMap, RetargetSpec},
    rig::{
        RigSpec,
        auto_map::{by_name, by_name_alone, by_role, known_names, role_pair, roles_of},
        error::{SpecError, SpecErrorKind, SpecField},
        named_pair::NamedPair,
        rig::Rig,
    },
};

/// What belongs together.
pub(in crate::retarget) struct Found {
    /// The pairs of chains, each with joints on both sides.
    pub(in crate::retarget) pairs: Vec<NamedPair>,
    /// What moves the whole thing, for two skeletons without a body that were paired by names alone.
    pub(in crate::retarget) tops: Option<Tops>,
}

/// The joint of each side that carries the others, and how much larger the target is.
pub(in crate::retarget) struct Tops {
    pub(in crate::retarget) source: usize,
    pub(in crate::retarget) target: usize,
    /// Length of the target's bones over the source's, each in its scene's unit.
    pub(in crate::retarget) size_ratio: f64,
}

/// Finds which chains belong together.
pub(in crate::retarget) fn find_pairs(
    spec: &RetargetSpec,
    source: &Rig<'_>,
    target: &Rig<'_>,
) -> Result<Found, SpecError> {
    let mut fields = Vec::new();
    let source_chains = explicit_chains(source, &spec.source, &mut fields);
    let target_chains = explicit_chains(target, &spec.target, &mut fields);
    let mut pairs = Vec::new();
    let mut tops = None;
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
                        source_name: name.clone(),
                        source: source_joints.clone(),
                        also: Vec::new(),
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
            let no_body = [source, target].iter().all(|side| !side.recognition.is_body());
            let is_open =
                [&spec.source, &spec.target].iter().all(|side| side.roles.is_empty() && side.chains.is_empty());
            if no_body && is_open {
                let named = by_name_alone(source, target);
                if !named.is_empty() {
                    tops = find_tops(source, target, &named);
                    pairs = named;
                }
            }
        }
    }
    SpecError::from_fields(fields).map_or(Ok(Found { pairs, tops }), Err)
}

/// Of the paired joints, the one that most others are below.
fn find_tops(source: &Rig<'_>, target: &Rig<'_>, pairs: &[NamedPair]) -> Option<Tops> {
    let skeleton = target.skeleton();
    let mut carried = vec![0_usize; skeleton.len()];
    for pair in pairs {
        let mut above = Some(pair.target[0]);
        while let Some(joint) = above {
            carried[joint] += 1;
            above = skeleton.parent(joint);
        }
    }
    let top = pairs.iter().rev().max_by_key(|pair| carried[pair.target[0]])?;
    let length = |side: &Rig<'_>, joint: usize| side.rest_local.transforms()[joint].translation.length();
    let below = pairs.iter().filter(|pair| pair.target != top.target);
    let (ours, theirs) = below.fold((0.0, 0.0), |(ours, theirs), pair| {
        (ours + length(target, pair.target[0]), theirs + length(source, pair.source[0]))
    });
    let size_ratio = if ours > 0.0 && theirs > 0.0 { ours / theirs } else { source.unit_meters / target.unit_meters };
    Some(Tops { source: top.source[0], target: top.target[0], size_ratio })
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
    let further = entry.also.iter().enumerate().filter_map(|(position, name)| {
        Some((name.clone(), joints_of(source, source_chains, name, &format!("also/{position}"))?))
    });
    let also: Vec<(String, Vec<usize>)> = further.collect();
    let both_roles = !source_chains.contains_key(&entry.source) && !target_chains.contains_key(&entry.target);
    if both_roles {
        let (from, to) = (roles_of(&entry.source), roles_of(&entry.target));
        let complete = |side: &Rig<'_>, roles: &[&str]| roles.iter().all(|role| !side.role(role).is_empty());
        if from.len() == to.len() && complete(source, &from) && complete(target, &to) {
            if from.len() > 1 && !entry.also.is_empty() {
                fields.push(SpecField::new(
                    SpecErrorKind::InvalidValue,
                    format!("/map/{index}/also"),
                    format!(
                        "'{}' is a limb of several roles, and the mean of several chains is for one; name the roles",
                        entry.target
                    ),
                ));
            }
            let pairs = from.into_iter().zip(to).filter_map(|(from, to)| role_pair(source, from, target, to));
            return pairs.map(|pair| NamedPair { also: also.clone(), ..pair }).collect();
        }
    }
    let source_joints = joints_of(source, source_chains, &entry.source, "source");
    let target_joints = joints_of(target, target_chains, &entry.target, "target");
    match (source_joints, target_joints) {
        (Some(from), Some(onto)) => {
            let (name, source_name) = (entry.target.clone(), entry.source.clone());
            let role = shared_role((source, &from), (target, &onto));
            vec![NamedPair { name, source_name, source: from, also, target: onto, role }]
        }
        _ => Vec::new(),
    }
}

/// The role that two chains are on their rigs, whatever they are called.
fn shared_role((source, from): (&Rig<'_>, &[usize]), (target, onto): (&Rig<'_>, &[usize])) -> Option<String> {
    let begins = |joints: &[usize], chain: &[usize]| !joints.is_empty() && joints.first() == chain.first();
    let role = target.roles.iter().find(|(role, joints)| begins(joints, onto) && begins(source.role(role), from));
    role.map(|(role, _)| role.clone())
}
