//! What belongs to limbs without being one of their joints: helpers that carry twist, and things that hands hold.

use std::collections::BTreeSet;

use super::{Part, Role, Side, body::Body, finding::Findings, lexicon::Sense};

/// A joint beside a limb that carries part of its twist. Joints in the limb itself that split a segment are no helpers; they
/// stand in the segment's role.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistHelper {
    /// The helper.
    pub joint: usize,
    /// The segment whose twist it carries part of: an upper arm, forearm, thigh or shin.
    pub role: Role,
    /// Where it lies on that segment: 0 at the segment's own joint, 1 at the next.
    pub fraction: f64,
}

/// A joint that a hand holds: a weapon, a tool, or the place where one is put.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Prop {
    /// The topmost joint of it.
    pub joint: usize,
    /// Which hand.
    pub side: Side,
}

/// Segments with the part that ends them.
const SEGMENTS: [(Part, Part); 4] =
    [(Part::UpperArm, Part::Forearm), (Part::Forearm, Part::Hand), (Part::Thigh, Part::Shin), (Part::Shin, Part::Foot)];

/// How far a nameless leaf may be off the segment to carry its twist, as a share of its distance along it: 5°.
const OFF_AXIS: f64 = 0.09;
/// A nameless leaf nearer to the segment's ends than this share may be anything.
const FROM_ENDS: f64 = 0.08;

/// Words of what hands hold.
const HELD: &[&str] = &[
    "weapon",
    "prop",
    "gun",
    "sword",
    "shield",
    "bow",
    "knife",
    "slot",
    "handslot",
    "socket",
    "attach",
    "attachment",
    "item",
    "holder",
    "tool",
    "grip",
];

/// Finds the helpers of every segment: by name, and leaves that lie on a segment.
pub(super) fn find_twist_helpers(body: &Body<'_>, findings: &Findings) -> Vec<TwistHelper> {
    let mut helpers = Vec::new();
    for side in Side::BOTH {
        for (part, next) in SEGMENTS {
            let role = Role::new(side, part);
            let Some((start, end)) = findings.first(side, part).zip(findings.first(side, next)) else { continue };
            let axis = body.positions[end] - body.positions[start];
            let length_squared = axis.length_squared();
            if length_squared <= 0.0 {
                continue;
            }
            for joint in candidates(body, findings, start, end) {
                let offset = body.positions[joint] - body.positions[start];
                let fraction = offset.dot(axis) / length_squared;
                let name = &body.names[joint];
                let off_axis = (offset - fraction * axis).length();
                let on_segment = (FROM_ENDS..=1.0 - FROM_ENDS).contains(&fraction)
                    && off_axis <= OFF_AXIS * offset.length()
                    && name.sense.is_none_or(|sense| segment_of(sense) == Some(part));
                let is_named = name.is_twist && name.sense.and_then(segment_of).is_none_or(|named| named == part);
                if (is_named || (on_segment && !name.is_end && !name.is_control && name.unexplained.is_empty()))
                    && name.side.is_none_or(|named| named == side)
                {
                    helpers.push(TwistHelper { joint, role, fraction: fraction.clamp(0.0, 1.0) });
                }
            }
        }
    }
    helpers.sort_by_key(|helper| helper.joint);
    helpers.dedup_by_key(|helper| helper.joint);
    helpers
}

/// Joints that could carry the twist of a segment: leaves below it, and named ones beside it.
fn candidates(body: &Body<'_>, findings: &Findings, start: usize, end: usize) -> Vec<usize> {
    let parent = |joint: usize| body.skeleton.parent(joint);
    let above = parent(start);
    let fits = |joint: &usize| {
        let joint = *joint;
        let hangs_from = |from: usize| parent(joint) == Some(from) || parent(joint).and_then(parent) == Some(from);
        let below = hangs_from(start) && joint != end && !body.is_below(joint, end);
        let beside = above.is_some() && parent(joint) == above && body.names[joint].is_twist;
        body.members[joint]
            && !findings.is_taken(joint)
            && ((below && (body.is_leaf(joint) || body.names[joint].is_twist)) || beside)
    };
    (0..body.skeleton.len()).filter(fits).collect()
}

/// The segment that a helper's name speaks of.
const fn segment_of(sense: Sense) -> Option<Part> {
    match sense {
        Sense::UpperArm | Sense::Arm | Sense::Shoulder => Some(Part::UpperArm),
        Sense::Forearm | Sense::Wrist => Some(Part::Forearm),
        Sense::Thigh | Sense::Hip => Some(Part::Thigh),
        Sense::Shin | Sense::Leg => Some(Part::Shin),
        _ => None,
    }
}

/// Finds what the hands hold, by name.
pub(super) fn find_props(body: &Body<'_>, findings: &Findings) -> Vec<Prop> {
    let mut props = Vec::new();
    for side in Side::BOTH {
        let Some(hand) = findings.first(side, Part::Hand) else { continue };
        let is_held = |joint: &usize| {
            let name = &body.names[*joint];
            body.is_below(*joint, hand) && !findings.is_taken(*joint) && HELD.iter().any(|word| name.has(word))
        };
        let held: Vec<usize> = (0..body.skeleton.len()).filter(is_held).collect();
        let all: BTreeSet<usize> = held.iter().copied().collect();
        let is_top = |joint: &usize| {
            let mut above = body.skeleton.parent(*joint);
            while let Some(parent) = above.filter(|parent| *parent != hand) {
                if all.contains(&parent) {
                    return false;
                }
                above = body.skeleton.parent(parent);
            }
            true
        };
        props.extend(held.into_iter().filter(is_top).map(|joint| Prop { joint, side }));
    }
    props
}
