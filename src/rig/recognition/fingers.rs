//! Fingers: the phalanges of each, and the bones of the palm below them.

use super::{
    Part, Role, Side,
    body::Body,
    finding::{Findings, sure},
    lexicon::Sense,
};

/// Joints of a whole finger; one more is its tip or its metacarpal.
const PHALANGES: usize = 3;

/// Finds the fingers of one side, by name, else by number (3ds Max Biped, MakeHuman).
pub(super) fn find_fingers(body: &Body<'_>, side: Side, findings: &mut Findings) {
    let palm = findings.first(side, Part::Hand).or_else(|| findings.first(side, Part::Forearm));
    let numbered = numbered_fingers(body, side, palm);
    let mut fingers: Vec<(Part, Vec<usize>)> = Vec::new();
    for part in Part::FINGERS {
        let all = body.candidates(Some(side), &[Sense::Finger(part)]);
        let below = palm.map_or_else(|| all.clone(), |palm| body.below(&all, palm));
        // Tracked hands keep all joints beside one another.
        let named = chain(body, if below.is_empty() { &all } else { &below });
        let declared = findings.declared.get(&Role::new(side, part)).cloned().unwrap_or_default();
        let joints = if !declared.iter().all(|joint| named.contains(joint)) {
            declared
        } else if named.is_empty() {
            numbered.iter().find(|finger| finger.0 == part).map(|finger| finger.1.clone()).unwrap_or_default()
        } else {
            named
        };
        fingers.push((part, joints));
    }
    let thumb_count = fingers.first().map_or(0, |thumb| thumb.1.len());
    let metacarpals = body.candidates(Some(side), &[Sense::Metacarpal, Sense::Palm]);
    for (part, joints) in fingers {
        let Some(&first) = joints.first() else { continue };
        let (own_metacarpal, phalanges) = split(body, palm, part, &joints, thumb_count);
        if let Some(role) = part.metacarpal().map(|metacarpal| Role::new(side, metacarpal)) {
            let above = body.skeleton.parent(first).filter(|parent| metacarpals.contains(parent));
            if let Some(joint) = own_metacarpal.or(above) {
                findings.assign(role, &[joint], sure::DECIDED, "the bone of the palm above the finger");
            }
        }
        findings.assign(Role::new(side, part), phalanges, sure::NAMED, "its name says so");
    }
}

/// The longest run of joints below one another, or all of them by number where none is below another.
fn chain(body: &Body<'_>, joints: &[usize]) -> Vec<usize> {
    let tops = body.topmost(joints);
    let run = |top: usize| {
        let end = body.below(joints, top).last().copied().unwrap_or(top);
        let path = body.path(top, end).unwrap_or_default();
        path.into_iter().filter(|joint| joints.contains(joint)).collect::<Vec<_>>()
    };
    let longest = tops.iter().rev().map(|top| run(*top)).max_by_key(Vec::len).unwrap_or_default();
    if longest.len() == 1 && tops.len() > 1 {
        let mut flat = tops;
        flat.sort_by_key(|joint| (body.names[*joint].digits.clone(), *joint));
        return flat;
    }
    longest
}

/// Splits off a metacarpal that is named like the phalanges, and a tip.
fn split<'a>(
    body: &Body<'_>,
    palm: Option<usize>,
    part: Part,
    joints: &'a [usize],
    thumb_count: usize,
) -> (Option<usize>, &'a [usize]) {
    let named_metacarpal = body.names[joints[0]].has("metacarpal") && part != Part::Thumb;
    if named_metacarpal {
        return (Some(joints[0]), &joints[1..]);
    }
    if joints.len() != PHALANGES + 1 {
        return (None, joints);
    }
    let length = |from: usize, to: usize| body.positions[from].distance(body.positions[to]);
    let starts_in_palm = part != Part::Thumb
        && thumb_count <= PHALANGES
        && palm.is_some_and(|palm| length(palm, joints[0]) < length(joints[0], joints[1]));
    if starts_in_palm { (Some(joints[0]), &joints[1..]) } else { (None, &joints[..PHALANGES]) }
}

/// Fingers that are numbered from 0 or 1, the thumb first: `Finger0`, `Finger01` or `finger1-1`.
fn numbered_fingers(body: &Body<'_>, side: Side, palm: Option<usize>) -> Vec<(Part, Vec<usize>)> {
    let all = body.candidates(Some(side), &[Sense::AnyFinger]);
    let all = palm.map_or_else(|| all.clone(), |palm| body.below(&all, palm));
    // The digits of a prefix (`Bip01`) come first; of `01`, the first digit is the finger.
    let number = |joint: usize| {
        let name = &body.names[joint];
        let digits = if name.has("bip") { name.digits.get(1) } else { name.digits.first() };
        digits.and_then(|digits| digits.chars().next()).and_then(|digit| digit.to_digit(10))
    };
    let mut by_number: Vec<(u32, Vec<usize>)> = Vec::new();
    for joint in all {
        if let Some(number) = number(joint) {
            match by_number.iter_mut().find(|entry| entry.0 == number) {
                Some(entry) => entry.1.push(joint),
                None => by_number.push((number, vec![joint])),
            }
        }
    }
    by_number.sort_by_key(|entry| entry.0);
    // One numbered finger may be all fingers in one; from two on they are fingers.
    let Some(base) = by_number.first().map(|entry| entry.0).filter(|base| *base < 2 && by_number.len() > 1) else {
        return Vec::new();
    };
    let part = |number: u32| Part::FINGERS.get((number - base) as usize).copied();
    by_number.into_iter().filter_map(|(number, joints)| Some((part(number)?, chain(body, &joints)))).collect()
}
