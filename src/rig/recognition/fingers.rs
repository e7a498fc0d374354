//! Fingers: the phalanges of each, and the bones of the palm below them.

use glam::DVec3;

use super::{
    Part, Role, Side,
    body::Body,
    finding::{Findings, sure},
    lexicon::Sense,
};

/// Joints of a whole finger; one more is its tip or its metacarpal.
pub(super) const PHALANGES: usize = 3;
/// Fingers whose first joints are nearer to one another than this share of the first bone begin on one spot. Knuckles lie farther
/// apart: what begins so are the bones of the palm.
const ON_ONE_SPOT: f64 = 0.15;

/// Where a finger's chain of joints begins, and how long its first bone is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Start {
    place: DVec3,
    bone: f64,
}

impl Start {
    pub(super) fn of(positions: &[DVec3], joints: &[usize]) -> Self {
        let place = joints.first().map_or(DVec3::ZERO, |joint| positions[*joint]);
        Self { place, bone: joints.get(1).map_or(0.0, |next| positions[*next].distance(place)) }
    }

    fn is_at(&self, place: DVec3) -> bool {
        self.place.distance(place) < ON_ONE_SPOT * self.bone
    }
}

/// For each finger, whether it begins where at least half of the others do: two bones of a palm may begin near one another by chance.
pub(super) fn spots(starts: &[Start]) -> Vec<bool> {
    let enough = (starts.len() / 2).max(1);
    let meets = |one: usize, other: usize| one != other && starts[one].is_at(starts[other].place);
    let met = |one: usize| (0..starts.len()).filter(|other| meets(one, *other)).count();
    (0..starts.len()).map(|one| met(one) >= enough).collect()
}

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
    let palms = Palms::new(body, palm, &fingers);
    let metacarpals = body.candidates(Some(side), &[Sense::Metacarpal, Sense::Palm]);
    let between = bones_between(body, palm, &fingers);
    for (part, joints) in fingers {
        let Some(&first) = joints.first() else { continue };
        let (own_metacarpal, phalanges) = palms.split(part, &joints);
        if let Some(role) = part.metacarpal().map(|metacarpal| Role::new(side, metacarpal)) {
            let above = body.skeleton.parent(first).filter(|parent| metacarpals.contains(parent));
            if let Some(joint) = own_metacarpal.or(above) {
                findings.assign(role, &[joint], sure::DECIDED, "the bone of the palm above the finger");
            } else if let Some((_, joint)) = between.iter().find(|(finger, _)| *finger == part) {
                findings.assign(role, &[*joint], sure::STRUCTURE, "between the hand and the finger");
            }
        }
        findings.assign(Role::new(side, part), phalanges, sure::NAMED, "its name says so");
    }
}

/// The joints between the hand and each finger that are there for one finger only, whatever they are called: bones of the palm. One
/// alone may be anything.
fn bones_between(body: &Body<'_>, palm: Option<usize>, fingers: &[(Part, Vec<usize>)]) -> Vec<(Part, usize)> {
    let Some(palm) = palm else { return Vec::new() };
    let parent = |joint: usize| body.skeleton.parent(joint);
    let carries_one =
        |joint: usize| body.skeleton.joints().iter().filter(|below| below.parent == Some(joint)).count() == 1;
    let between = |(part, joints): &(Part, Vec<usize>)| {
        let above = parent(*joints.first()?).filter(|above| parent(*above) == Some(palm))?;
        (body.names[above].sense.is_none() && carries_one(above)).then_some((*part, above))
    };
    let found: Vec<(Part, usize)> =
        fingers.iter().filter(|finger| finger.0 != Part::Thumb).filter_map(between).collect();
    if found.len() > 1 { found } else { Vec::new() }
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

/// What tells the bones of the palm from phalanges that are named like them.
struct Palms<'a> {
    body: &'a Body<'a>,
    palm: Option<usize>,
    /// Joints of the thumb.
    thumb_count: usize,
    /// First joints of fingers that begin where another finger begins.
    on_one_spot: Vec<usize>,
    /// Whether every finger that begins so has one joint more than phalanges, and so no tip.
    without_tips: bool,
}

impl<'a> Palms<'a> {
    fn new(body: &'a Body<'a>, palm: Option<usize>, fingers: &[(Part, Vec<usize>)]) -> Self {
        let others = || fingers.iter().filter(|(part, joints)| *part != Part::Thumb && joints.len() >= PHALANGES);
        let starts = others().map(|(_, joints)| Start::of(&body.positions, joints)).collect::<Vec<_>>();
        let is_on_spot = spots(&starts);
        let on_spot: Vec<&Vec<usize>> =
            others().zip(is_on_spot).filter(|(_, is_on_spot)| *is_on_spot).map(|((_, joints), _)| joints).collect();
        Self {
            body,
            palm,
            thumb_count: fingers.iter().find(|finger| finger.0 == Part::Thumb).map_or(0, |thumb| thumb.1.len()),
            without_tips: on_spot.iter().all(|joints| joints.len() == PHALANGES + 1),
            on_one_spot: on_spot.iter().map(|joints| joints[0]).collect(),
        }
    }

    /// Splits off a metacarpal that is named like the phalanges, and a tip.
    fn split<'j>(&self, part: Part, joints: &'j [usize]) -> (Option<usize>, &'j [usize]) {
        let phalanges_from = |first: usize| &joints[first..joints.len().min(first + PHALANGES)];
        if part == Part::Thumb {
            // A thumb has its metacarpal first; one more joint that begins with the bones of the palm is none of it.
            let is_helped = joints.len() == PHALANGES + 1 && self.without_tips && self.begins_with_others(joints);
            return match joints.len() {
                _ if is_helped => (None, &joints[1..]),
                4 => (None, phalanges_from(0)),
                _ => (None, joints),
            };
        }
        if self.body.names[joints[0]].has("metacarpal") || self.on_one_spot.contains(&joints[0]) {
            return (Some(joints[0]), phalanges_from(1));
        }
        if joints.len() != PHALANGES + 1 {
            return (None, joints);
        }
        let length = |from: usize, to: usize| self.body.positions[from].distance(self.body.positions[to]);
        let starts_in_palm = self.thumb_count <= PHALANGES
            && self.palm.is_some_and(|palm| length(palm, joints[0]) < length(joints[0], joints[1]));
        if starts_in_palm { (Some(joints[0]), &joints[1..]) } else { (None, phalanges_from(0)) }
    }

    fn begins_with_others(&self, joints: &[usize]) -> bool {
        let start = Start::of(&self.body.positions, joints);
        self.on_one_spot.iter().any(|other| start.is_at(self.body.positions[*other]))
    }
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
    // Where the thumb has a name of its own, the first number is the next finger.
    let thumbs = body.candidates(Some(side), &[Sense::Finger(Part::Thumb)]);
    let has_thumb = palm.map_or(!thumbs.is_empty(), |palm| !body.below(&thumbs, palm).is_empty());
    let part = |number: u32| Part::FINGERS.get((number - base) as usize + usize::from(has_thumb)).copied();
    by_number.into_iter().filter_map(|(number, joints)| Some((part(number)?, chain(body, &joints)))).collect()
}
