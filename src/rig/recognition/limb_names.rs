//! A limb as a whole: its shape and all of its names weighed together.
//!
//! One segment at a time, a wrong name looks like any other. Over a whole limb names that are consistently those of the next or the
//! previous segment are seen as a shift, names that contradict the shape in no order say nothing, and a segment that is missing is
//! more likely than a foot for a shin.
//!
//! Every way of seeing the joints as upper segment, lower segment and end is weighed by the geometry that [`super::structure`] gives
//! it and by the likelihood of the names under each hypothesis of how the limb is named.

use super::{Part, Role, Side, body::Body, finding::Findings, lexicon::Sense, structure::SeenLimb};

/// How the joints of a limb are named.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Naming {
    /// After the segment that the joint starts.
    Own,
    /// After the next segment: the joint at the hip is called knee.
    Next,
    /// After the previous segment: the joint at the knee is called thigh.
    Previous,
    /// In no order.
    Arbitrary,
}

/// What a limb's joints mean, all things weighed.
#[derive(Clone, Debug)]
pub(super) struct LimbVerdict {
    /// Upper segment, lower segment and end, as places on the limb's way; a segment may be missing.
    pub segments: [Option<usize>; 3],
    /// How the joints are named.
    pub naming: Naming,
    /// Likelihood of each of the three against all other ways of seeing the limb.
    pub likelihood: [f64; 3],
    /// The weight of this against that of what the names alone say.
    pub against_names: f64,
    /// Likelihood of each place on the limb's way as the start of each of the three.
    pub by_place: Vec<[f64; 3]>,
    /// Whether names say anything about the limb.
    pub is_named: bool,
    /// For each of the three, the shape's best way of seeing another joint there, against the best way at all.
    pub rivals: [f64; 3],
}

/// How likely each kind of naming is before a name is looked at.
const NAMINGS: [(Naming, f64); 4] =
    [(Naming::Own, 0.85), (Naming::Next, 0.06), (Naming::Previous, 0.05), (Naming::Arbitrary, 0.04)];
/// Likelihood of a name that says nothing.
const SILENT: f64 = 0.5;
/// Likelihood of a name that speaks of another segment.
const WRONG: f64 = 0.02;
/// Likelihood of any name of a limb whose names are in no order.
const ANY: f64 = 0.06;
/// Likelihood of a joint inside a segment that is not named like the segment.
const UNLIKE_SPLIT: f64 = 0.1;
/// Likelihood of a joint without a meaning between a hand and its fingers, and of fingers where there is no hand.
const BEFORE_FINGERS: f64 = 0.2;
/// How much a poor shape counts against a limb: an exponent.
const GEOMETRY_POWER: f64 = 1.5;
/// Longer limbs are not looked at to their ends.
const MAX_JOINTS: usize = 14;
/// How much a limb that lacks a segment looks like a limb.
const INCOMPLETE: f64 = 0.01;
/// Joints that are nearer to one another than this share of the limb's length lie in one place.
const NO_LENGTH_SHARE: f64 = 1e-4;
/// A segment is taken for missing only where at least two joints are named.
const FEWEST_NAMED: usize = 2;

/// The segments of a limb as numbers from the body outward: what lies before it, upper, lower, end, and what lies beyond.
const BEFORE: usize = 0;
const UPPER: usize = 1;
const BEYOND: usize = 4;

/// Weighs one limb. Nothing where the file declares its joints, where its names point to joints that are not on it, or where two of
/// the joints that are named lie in one place: shape cannot tell those apart.
pub(super) fn weigh_limb(body: &Body<'_>, limb: &SeenLimb, side: Side, named: &Findings) -> Option<LimbVerdict> {
    let parts = if limb.is_leg { LEG } else { ARM };
    let is_declared = parts.iter().any(|part| named.declared_first(side, *part).is_some());
    let place_of = |part: Part| {
        let joint = named.first(side, part)?;
        Some(limb.joints.iter().position(|other| *other == joint))
    };
    let by_name = parts.map(place_of);
    if is_declared || by_name.contains(&Some(None)) {
        return None;
    }
    let by_name = by_name.map(Option::flatten);
    if has_bone_without_length(body, limb, by_name) {
        return None;
    }
    let senses: Vec<Option<Sense>> =
        limb.joints.iter().take(MAX_JOINTS).map(|joint| sense_of(body, *joint, side)).collect();
    let named_count = senses.iter().flatten().filter(|sense| is_of_limb(**sense, limb.is_leg)).count();
    let mut weighed: Vec<([Option<usize>; 3], Naming, f64)> = Vec::new();
    let mut weigh = |segments: [Option<usize>; 3], geometry: f64| {
        for (naming, prior) in NAMINGS {
            let names = likelihood(body, limb, &senses, segments, naming);
            weighed.push((segments, naming, geometry.powf(GEOMETRY_POWER) * prior * names));
        }
    };
    for seen in &limb.ways {
        weigh([Some(seen.upper), Some(seen.lower), Some(seen.end)], seen.score);
    }
    if named_count >= FEWEST_NAMED {
        let count = limb.joints.len().min(MAX_JOINTS);
        for first in 0..count {
            for second in first + 1..count {
                let (one, other) = (Some(first), Some(second));
                for segments in [[None, one, other], [one, None, other], [one, other, None]] {
                    weigh(segments, (INCOMPLETE * limb.two_bones(segments)).powf(1.0 / GEOMETRY_POWER));
                }
            }
        }
    }
    let total: f64 = weighed.iter().map(|entry| entry.2).sum();
    let best = weighed.iter().max_by(|one, other| one.2.total_cmp(&other.2)).filter(|best| best.2 > 0.0)?;
    let weight_of = |fits: &dyn Fn(&[Option<usize>; 3]) -> bool| -> f64 {
        weighed.iter().filter(|entry| fits(&entry.0)).map(|entry| entry.2).sum()
    };
    let own = weight_of(&|segments| *segments == best.0);
    let names = weight_of(&|segments| *segments == by_name);
    Some(LimbVerdict {
        segments: best.0,
        naming: best.1,
        likelihood: [0, 1, 2].map(|part: usize| weight_of(&|segments| segments[part] == best.0[part]) / total),
        by_place: (0..limb.joints.len())
            .map(|place| [0, 1, 2].map(|part: usize| weight_of(&|segments| segments[part] == Some(place)) / total))
            .collect(),
        is_named: named_count > 0,
        rivals: rivals(limb, best.0),
        against_names: if best.0 == by_name { 1.0 } else { own / names.max(f64::MIN_POSITIVE) },
    })
}

/// Whether two of the named joints of a limb lie in one place.
fn has_bone_without_length(body: &Body<'_>, limb: &SeenLimb, by_name: [Option<usize>; 3]) -> bool {
    let place = |segment: Option<usize>| segment.map(|place| body.positions[limb.joints[place]]);
    let bones = limb.joints.windows(2).map(|bone| body.positions[bone[0]].distance(body.positions[bone[1]]));
    let no_length = NO_LENGTH_SHARE * bones.sum::<f64>();
    let coincide = |one: usize, other: usize| {
        place(by_name[one]).zip(place(by_name[other])).is_some_and(|(one, other)| one.distance(other) <= no_length)
    };
    coincide(0, 1) || coincide(1, 2)
}

/// How near the shape comes to seeing another joint in each place.
fn rivals(limb: &SeenLimb, segments: [Option<usize>; 3]) -> [f64; 3] {
    let best = limb.ways.first().map_or(0.0, |way| way.score).max(f64::MIN_POSITIVE);
    [0, 1, 2].map(|part: usize| {
        let start = |way: &super::structure::Segments| [way.upper, way.lower, way.end][part];
        let other = limb.ways.iter().filter(|way| Some(start(way)) != segments[part]);
        other.map(|way| way.score / best).fold(0.0, f64::max)
    })
}

pub(super) const ARM: [Part; 3] = [Part::UpperArm, Part::Forearm, Part::Hand];
pub(super) const LEG: [Part; 3] = [Part::Thigh, Part::Shin, Part::Foot];

/// What a name means on that side; nothing where it is of the other side, or marks or steers something.
fn sense_of(body: &Body<'_>, joint: usize, side: Side) -> Option<Sense> {
    let name = &body.names[joint];
    let is_of_side = name.side.is_some_and(|named| named == side);
    name.sense.filter(|sense| is_of_side && !name.is_end && !name.is_twist && body.means(joint, &[*sense]))
}

/// The likelihood of a limb's names where its segments are these and it is named in that way.
fn likelihood(
    body: &Body<'_>,
    limb: &SeenLimb,
    senses: &[Option<Sense>],
    segments: [Option<usize>; 3],
    naming: Naming,
) -> f64 {
    let mut slot = BEFORE;
    let last = segments.iter().flatten().max().copied().unwrap_or(0);
    let mut likelihood = 1.0;
    for (place, sense) in senses.iter().enumerate() {
        let starts = segments.iter().position(|start| *start == Some(place));
        slot = match starts {
            Some(segment) => UPPER + segment,
            None if place > last => BEYOND,
            None => slot,
        };
        let Some(sense) = sense else {
            likelihood *= SILENT;
            continue;
        };
        if is_finger(*sense) && place <= last {
            // Fingers are no part of the limb before its end.
            likelihood *= WRONG;
            continue;
        }
        if is_finger(*sense) || place > last + 1 {
            likelihood *= SILENT;
            continue;
        }
        let is_split = starts.is_none() && (UPPER..BEYOND).contains(&slot);
        if is_split && naming != Naming::Arbitrary {
            let alike = place > 0 && senses[place - 1] == Some(*sense);
            likelihood *= if alike || body.names[limb.joints[place]].is_twist { SILENT } else { UNLIKE_SPLIT };
            continue;
        }
        let named_slot = match naming {
            Naming::Own => Some(slot),
            Naming::Next => Some((slot + 1).min(BEYOND)),
            Naming::Previous => slot.checked_sub(1),
            Naming::Arbitrary => None,
        };
        likelihood *= match named_slot {
            Some(slot) => weight(*sense, slot, limb.is_leg).max(WRONG),
            None if naming == Naming::Arbitrary => ANY,
            None => SILENT,
        };
    }
    likelihood * before_fingers(senses, segments)
}

/// The likelihood of where the fingers begin: below the hand, with nothing else between them than a bone of the palm.
fn before_fingers(senses: &[Option<Sense>], segments: [Option<usize>; 3]) -> f64 {
    let Some(first) = senses.iter().position(|sense| sense.is_some_and(is_finger)) else { return 1.0 };
    match segments[2] {
        Some(end) if end + 1 == first => 1.0,
        Some(end) if end < first && senses[end + 1..first].iter().all(Option::is_some) => 1.0,
        _ => BEFORE_FINGERS,
    }
}

const fn is_finger(sense: Sense) -> bool {
    matches!(sense, Sense::Finger(_) | Sense::AnyFinger | Sense::Metacarpal)
}

fn is_of_limb(sense: Sense, is_leg: bool) -> bool {
    (BEFORE..BEYOND).any(|slot| weight(sense, slot, is_leg) > 0.0)
}

/// How likely a joint of a segment is called so.
const fn weight(sense: Sense, slot: usize, is_leg: bool) -> f64 {
    match (is_leg, sense, slot) {
        (true, Sense::Hip, 0 | 1)
        | (true, Sense::Leg, 1 | 2)
        | (true, Sense::Foot, 3)
        | (false, Sense::Shoulder, 0 | 1)
        | (false, Sense::Arm, 1) => 0.6,
        (true, Sense::Thigh, 1)
        | (true, Sense::Shin, 2)
        | (true, Sense::Ankle, 3)
        | (true, Sense::Toe, 4)
        | (false, Sense::Clavicle, 0)
        | (false, Sense::UpperArm, 1)
        | (false, Sense::Forearm, 2)
        | (false, Sense::Wrist | Sense::Hand, 3) => 0.9,
        (true, Sense::Foot, 4)
        | (true, Sense::Leg, 3)
        | (false, Sense::Arm, 0 | 2)
        | (false, Sense::Palm, 3 | 4)
        | (false, Sense::Hand, 4) => 0.2,
        _ => 0.0,
    }
}

/// The role of what lies before the limb and beyond it.
pub(super) fn neighbors(is_leg: bool, side: Side) -> [Option<Role>; 2] {
    if is_leg { [None, Some(Role::new(side, Part::Toe))] } else { [Some(Role::new(side, Part::Clavicle)), None] }
}
