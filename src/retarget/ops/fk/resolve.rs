//! What the `fk` op drives, and how.

use super::twists::is_lower;
use crate::retarget::ops::pelvis::resolve::constant_alpha;
use crate::{
    retarget::{
        mapping::{ChainPair, Chord, ChordCorrection, Drive, FurtherChain, Spacing},
        ops::FkOp,
        spec::{RetargetSpec, RotationMode},
    },
    rig::{
        Align,
        alignment::split,
        auto_map::{known_names, roles_of},
        error::{SpecErrorKind, SpecField},
        leg_rows::is_whole_leg,
        named_pair::NamedPair,
        rig::Rig,
    },
};

/// The joints below a chest take this much of a correction of the spine's line before the chest gives way, in radians: 6°.
const FREE_TRUNK_CORRECTION: f64 = 0.105;
/// A correction of a spine or neck bends it by at most this much beyond the source's bends, in radians: 15°.
const MAX_TRUNK_CORRECTION: f64 = 0.262;

pub(in crate::retarget) fn resolve_fk(
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
    let alpha = constant_alpha(&op.alpha, op.frames);
    let wanted = |pair: &&NamedPair| mask.as_ref().is_none_or(|mask| mask.contains(&pair.name.as_str()));
    pairs
        .iter()
        .filter(wanted)
        .flat_map(|pair| {
            let entry = spec.map.iter().flatten().find(|entry| roles_of(&entry.target).contains(&pair.name.as_str()));
            let rotation = entry.and_then(|entry| entry.rotation).unwrap_or(op.rotation);
            let drive = Drive {
                carry: op.carry,
                rotation,
                translation: entry.and_then(|entry| entry.translation).unwrap_or(op.translation),
                rotation_alpha: alpha * entry.and_then(|entry| entry.rotation_alpha).unwrap_or(op.rotation_alpha),
                translation_alpha: alpha
                    * entry.and_then(|entry| entry.translation_alpha).unwrap_or(op.translation_alpha),
            };
            if let Some(chains) = leg_chains(pair, drive, source, target) {
                return chains;
            }
            let (from, spacing) = spread(pair, (&pair.source_name, &pair.source), rotation, source);
            let also = pair.also.iter().map(|(name, joints)| {
                let (source, spacing) = spread(pair, (name, joints), rotation, source);
                FurtherChain { source, spacing }
            });
            let chord = if spec.align == Align::Off { None } else { find_chord(pair, source, target) };
            vec![ChainPair {
                name: pair.name.clone(),
                source: from,
                also: also.collect(),
                target: pair.target.clone(),
                drive,
                spacing,
                chord,
            }]
        })
        .collect()
}

/// Which joints of the source a chain follows, and at which places, when the numbers of joints differ. `name` and `joints` are
/// those of one of the pair's source chains.
fn spread(
    pair: &NamedPair,
    (name, joints): (&str, &[usize]),
    rotation: RotationMode,
    source: &Rig<'_>,
) -> (Vec<usize>, Spacing) {
    let plain = (joints.to_vec(), Spacing::Length);
    let (sources, targets) = (joints.len(), pair.target.len());
    if pair.role.is_none() || rotation != RotationMode::Auto || sources == targets {
        return plain;
    }
    let (side, part) = split(name);
    // What a split forearm twists on its way belongs to the hand; the elbow is where its first joint is.
    if is_lower(part) && targets == 1 {
        return (joints[..1].to_vec(), Spacing::Length);
    }
    let last = |part: &str| source.role(part).last().copied();
    let (lead, spacing) = match part {
        "spine" if sources == 1 => (last("pelvis"), Spacing::Led),
        "neck" if sources == 1 => (last("spine").or_else(|| last("pelvis")), Spacing::Led),
        "thumb" | "index" | "middle" | "ring" | "pinky" => {
            let metacarpal = last(&format!("{side}{part}_metacarpal"));
            (metacarpal.or_else(|| last(&format!("{side}hand"))), Spacing::Curled)
        }
        _ => return plain,
    };
    match lead.filter(|lead| !joints.contains(lead)) {
        Some(lead) => (std::iter::once(lead).chain(joints.iter().copied()).collect(), spacing),
        None => plain,
    }
}

/// An animal's leg bone by bone, where the source has joints between two that belong together: what bends there turns the one
/// bone of the target as a whole, so that it points where the source's bones together lead. Nothing for other chains.
fn leg_chains(pair: &NamedPair, drive: Drive, source: &Rig<'_>, target: &Rig<'_>) -> Option<Vec<ChainPair>> {
    let is_leg = pair.role.as_deref().is_some_and(is_whole_leg);
    if !is_leg || drive.rotation != RotationMode::Auto || pair.source.len() != pair.target.len() {
        return None;
    }
    let path = |position: usize| {
        let next = *pair.source.get(position + 1)?;
        source.skeleton().path(pair.source[position], next).map(|path| path[..path.len() - 1].to_vec())
    };
    let pieces: Vec<Vec<usize>> =
        (0..pair.source.len()).map(|position| path(position).unwrap_or_else(|| vec![pair.source[position]])).collect();
    if pieces.iter().all(|piece| piece.len() == 1) {
        return None;
    }
    let chain = |(position, piece): (usize, Vec<usize>)| {
        let joint = pair.target[position];
        let end =
            pair.target.get(position + 1).copied().filter(|end| target.skeleton().is_ancestor_or_self(joint, *end));
        let ends = end.zip(pair.source.get(position + 1).copied()).filter(|_| piece.len() > 1);
        ChainPair {
            name: pair.name.clone(),
            source: piece,
            also: Vec::new(),
            target: vec![joint],
            drive,
            spacing: Spacing::Length,
            chord: ends.map(|(target_end, source_end)| Chord {
                source_end,
                target_end,
                correction: ChordCorrection::Whole,
            }),
        }
    };
    Some(pieces.into_iter().enumerate().map(chain).collect())
}

/// What a spine or a neck leads to, on both sides.
fn find_chord(pair: &NamedPair, source: &Rig<'_>, target: &Rig<'_>) -> Option<Chord> {
    let limited = ChordCorrection::Limited(MAX_TRUNK_CORRECTION);
    let (ends, correction): (&[&str], ChordCorrection) = match pair.role.as_deref()? {
        // Its slope is the animal's own, as in its rest pose.
        "spine" if target.stands_on_four() => return None,
        "spine" if pair.target.len() > 1 => {
            (&["neck", "head"], ChordCorrection::BelowChest { free: FREE_TRUNK_CORRECTION, max: MAX_TRUNK_CORRECTION })
        }
        "spine" => (&["neck", "head"], limited),
        "neck" => (&["head"], limited),
        _ => return None,
    };
    let end = ends.iter().find(|end| !source.role(end).is_empty() && !target.role(end).is_empty())?;
    let (source_end, target_end) = (source.role(end)[0], target.role(end)[0]);
    let below = |rig: &Rig<'_>, chain: &[usize], end: usize| {
        let last = chain[chain.len() - 1];
        last != end && rig.skeleton().is_ancestor_or_self(last, end)
    };
    let connected = below(source, &pair.source, source_end) && below(target, &pair.target, target_end);
    connected.then_some(Chord { source_end, target_end, correction })
}

/// Parents before children; ties by name, as ikrigretarget does it.
pub(in crate::retarget) fn order_chains(chains: &mut [ChainPair]) {
    chains.sort_by(|first, second| (first.target[0], &first.name).cmp(&(second.target[0], &second.name)));
}
