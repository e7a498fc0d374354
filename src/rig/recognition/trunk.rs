//! Root, pelvis, spine, neck and head, and what hangs on the head.
//!
//! Found by where the limbs hang; names decide only what the hierarchy leaves open.

use super::{
    Part, Role, Side,
    body::Body,
    finding::{Findings, sure},
    lexicon::Sense,
    names::Layer,
};

/// The joints that the limbs of both sides hang from.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Limbs {
    /// The first joint of each arm, clavicles included.
    pub arms: [Option<usize>; 2],
    /// The first joint of each leg.
    pub legs: [Option<usize>; 2],
}

impl Limbs {
    fn chest(&self, body: &Body<'_>) -> Option<usize> {
        let chest = match self.arms {
            [Some(left), Some(right)] => body.common_ancestor(left, right),
            [Some(arm), None] | [None, Some(arm)] => body.skeleton.parent(arm),
            [None, None] => None,
        };
        chest.filter(|joint| body.members[*joint])
    }
}

/// Finds root, pelvis, spine, neck, head, jaw, eyes and tail.
pub(super) fn find_trunk(body: &Body<'_>, limbs: Limbs, findings: &mut Findings) {
    let chest = limbs.chest(body);
    let head = find_head(body, chest, findings);
    let spines = body.candidates(None, &[Sense::Spine]);
    if head.is_none() && find_numbered_spine(body, limbs, &spines, findings) {
        find_root(body, findings);
        return;
    }
    find_pelvis(body, limbs, chest.or(head), findings);
    let pelvis = findings.first(Side::Center, Part::Pelvis);
    let top = head.or(chest).or_else(|| {
        let below = pelvis.map_or_else(Vec::new, |pelvis| body.below(&spines, pelvis));
        below.last().copied()
    });
    let path = pelvis.zip(top).and_then(|(pelvis, top)| body.path(pelvis, top)).unwrap_or_default();
    let above_pelvis = path.get(1..).unwrap_or_default();
    // Arms may hang from the neck (3ds Max Biped); the spine ends below it all the same.
    let is_neck = |joint: &usize| body.means(*joint, &[Sense::Neck]);
    let until_chest = above_pelvis.iter().position(|joint| Some(*joint) == chest).map(|index| index + 1);
    let until_neck = above_pelvis.iter().position(is_neck);
    let until_head = above_pelvis.iter().position(|joint| Some(*joint) == head);
    let end = [until_chest, until_neck, until_head].into_iter().flatten().min().unwrap_or(above_pelvis.len());
    // Without arms, only names can say where the spine ends.
    let (spine, rest) = above_pelvis.split_at(end);
    let spine: Vec<usize> = if chest.is_some() {
        spine.to_vec()
    } else {
        spine.iter().copied().filter(|joint| spines.contains(joint)).collect()
    };
    findings.assign(Role::center(Part::Spine), &spine, spine_confidence(body, &spine), "from the pelvis to the arms");
    let neck: Vec<usize> = if head.is_some_and(|head| above_pelvis.contains(&head)) {
        rest.iter().copied().filter(|joint| Some(*joint) != head).collect()
    } else {
        let necks = body.candidates(None, &[Sense::Neck]);
        chest.map_or_else(Vec::new, |chest| body.below(&necks, chest))
    };
    let named = neck.iter().any(is_neck);
    let confidence = if named { sure::NAMED } else { sure::STRUCTURE };
    findings.assign(Role::center(Part::Neck), &neck, confidence, "from the arms to the head");
    find_root(body, findings);
}

/// Finds what hangs on the head, the tail and the wings.
pub(super) fn find_details(body: &Body<'_>, findings: &mut Findings) {
    let head = findings.first(Side::Center, Part::Head);
    let on_head = |joints: Vec<usize>| head.map_or_else(Vec::new, |head| body.below(&joints, head));
    let jaws = on_head(body.candidates(None, &[Sense::Jaw]));
    findings.assign(Role::center(Part::Jaw), jaws.get(..1).unwrap_or_default(), sure::NAMED, "its name says so");
    for side in Side::BOTH {
        let mut eyes = on_head(body.candidates(Some(side), &[Sense::Eye]));
        if let Some(declared) = findings.declared_first(side, Part::Eye) {
            eyes.insert(0, declared);
        }
        let eye = eyes.get(..1).unwrap_or_default();
        findings.assign(Role::new(side, Part::Eye), eye, sure::NAMED, "its name says so");
    }
    let tails = body.candidates(None, &[Sense::Tail]);
    if let Some(path) = tails.first().zip(tails.last()).and_then(|(first, last)| body.path(*first, *last)) {
        findings.assign(Role::center(Part::Tail), &path, sure::NAMED, "their names say so");
    }
    for side in Side::BOTH {
        let wings = body.candidates(Some(side), &[Sense::Wing]);
        let top = wings.first().copied();
        let end = top.and_then(|top| body.below(&wings, top).last().copied().or(Some(top)));
        if let Some(path) = top.zip(end).and_then(|(top, end)| body.path(top, end)) {
            findings.assign(Role::new(side, Part::Wing), &path, sure::NAMED, "its name says so");
        }
    }
}

fn find_head(body: &Body<'_>, chest: Option<usize>, findings: &mut Findings) -> Option<usize> {
    let heads = body.candidates(None, &[Sense::Head]);
    let in_place = chest.map_or_else(|| heads.clone(), |chest| body.below(&heads, chest));
    let head = findings
        .declared_first(Side::Center, Part::Head)
        .or_else(|| in_place.first().copied())
        .or_else(|| heads.first().copied())?;
    let (confidence, reason) = if chest.is_none_or(|chest| body.is_below(head, chest)) {
        (sure::NAMED, "its name says so")
    } else {
        (sure::MISPLACED, "named so, but not above the joint that the arms hang from")
    };
    findings.assign(Role::center(Part::Head), &[head], confidence, reason);
    findings.offer(Role::center(Part::Head), &body.topmost(&heads));
    Some(head)
}

fn find_pelvis(body: &Body<'_>, limbs: Limbs, above: Option<usize>, findings: &mut Findings) {
    let named = body.candidates(None, &[Sense::Pelvis]);
    let role = Role::center(Part::Pelvis);
    if let Some(declared) = findings.declared_first(Side::Center, Part::Pelvis) {
        findings.assign(role, &[declared], sure::DECLARED, "the file declares it");
        return;
    }
    let carrier = match limbs.legs {
        [Some(left), Some(right)] => body.common_ancestor(left, right),
        _ => None,
    };
    let carrier = carrier.and_then(|legs| above.map_or(Some(legs), |above| body.common_ancestor(legs, above)));
    match carrier.filter(|joint| body.members[*joint]) {
        Some(joint) if named.contains(&joint) => {
            findings.assign(role, &[joint], sure::NAMED, "named so, and legs and spine hang from it");
        }
        // 3ds Max Biped hangs the thighs from the first spine joint, below the pelvis.
        Some(joint) => match body.above(&named, joint).last() {
            Some(pelvis) => {
                findings.assign(role, &[*pelvis], sure::DECIDED, "named so, and legs and spine are below it");
            }
            None => findings.assign(role, &[joint], sure::STRUCTURE, "legs and spine hang from it"),
        },
        None => {
            let best = named.iter().rev().copied().max_by_key(|joint| {
                let carried = limbs.legs.iter().chain(&limbs.arms).flatten().chain(&above);
                carried.filter(|limb| body.is_below(**limb, *joint)).count()
            });
            if let Some(joint) = best {
                findings.assign(role, &[joint], sure::MISPLACED, "named so, but the legs do not hang from it");
            }
        }
    }
    findings.offer(role, &named);
}

/// Rigify: `spine`, `spine.001` and so on, from the pelvis to the head. How far the spine goes is seen from the arms.
fn find_numbered_spine(body: &Body<'_>, limbs: Limbs, spines: &[usize], findings: &mut Findings) -> bool {
    let Some((&first, &last)) = spines.first().zip(spines.last()) else { return false };
    let Some(chain) = body.path(first, last).filter(|chain| chain.len() > 2) else { return false };
    if body.names[first].layer == Layer::None || !chain.iter().all(|joint| spines.contains(joint)) {
        return false;
    }
    // In a full control rig the arms hang from the joint of another layer with the same number.
    let hung = limbs.chest(body).and_then(|chest| {
        let (name, same) = (&body.names[chest], |joint: &usize| body.names[*joint].digits == body.names[chest].digits);
        let twin = || chain.iter().position(same).filter(|_| name.sense == Some(Sense::Spine));
        chain.iter().position(|joint| *joint == chest).or_else(twin)
    });
    let chest = hung.unwrap_or_else(|| {
        // Arms that hang from the armature: the last spine joint below the clavicles.
        let arms: Vec<usize> = limbs.arms.iter().flatten().copied().collect();
        let axis = body.positions[last] - body.positions[first];
        let height = |joint: usize| (body.positions[joint] - body.positions[first]).dot(axis);
        let arm_height = arms.iter().map(|joint| height(*joint)).fold(f64::NEG_INFINITY, f64::max);
        chain.iter().rposition(|joint| height(*joint) <= arm_height).unwrap_or(chain.len() - 1)
    });
    if chest == 0 || chest + 1 >= chain.len() {
        return false;
    }
    // `hips` above a numbered spine is the pelvis itself.
    let hips = body.above(&body.candidates(None, &[Sense::Pelvis]), first);
    let (pelvis, spine_start) = hips.last().map_or((first, 1), |hips| (*hips, 0));
    let (confidence, reason) = (sure::STRUCTURE, "by its place in a numbered spine");
    findings.assign(Role::center(Part::Pelvis), &[pelvis], confidence, reason);
    findings.assign(Role::center(Part::Spine), &chain[spine_start..=chest], confidence, reason);
    findings.assign(Role::center(Part::Neck), &chain[chest + 1..chain.len() - 1], confidence, reason);
    findings.assign(Role::center(Part::Head), &chain[chain.len() - 1..], confidence, reason);
    true
}

/// The top joint above the pelvis, where there is one.
pub(super) fn find_root(body: &Body<'_>, findings: &mut Findings) {
    let mut above = findings.first(Side::Center, Part::Pelvis).and_then(|pelvis| body.skeleton.parent(pelvis));
    let mut root = None;
    while let Some(joint) = above {
        if body.members[joint] && !body.names[joint].is_control {
            root = Some(joint);
        }
        above = body.skeleton.parent(joint);
    }
    if let Some(joint) = root {
        findings.assign(Role::center(Part::Root), &[joint], sure::STRUCTURE, "the top joint above the pelvis");
    }
}

fn spine_confidence(body: &Body<'_>, spine: &[usize]) -> f64 {
    let named = spine.iter().all(|joint| body.means(*joint, &[Sense::Spine]));
    if named { sure::NAMED } else { sure::STRUCTURE }
}
