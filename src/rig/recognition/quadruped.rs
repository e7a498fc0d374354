//! Four legs: found by name, or seen in limbs that are named like a human's.

use std::collections::BTreeMap;

use glam::DVec3;

use super::{
    Part, Role, RoleFinding, Side,
    body::Body,
    facing::Points,
    finding::{Findings, sure},
    lexicon::Sense,
};
use crate::model::ModelPose;

/// A trunk that is farther than this from upright against its legs is level: the cosine.
const LEVEL_COSINE: f64 = 0.64;
/// Arms that point this much where the legs point stand on the ground: the cosine.
const ALIKE_COSINE: f64 = 0.6;

const ARM: [Part; 4] = [Part::Clavicle, Part::UpperArm, Part::Forearm, Part::Hand];
const LEG: [Part; 4] = [Part::Thigh, Part::Shin, Part::Foot, Part::Toe];

/// Finds legs that are named as front and hind legs. All four, or none.
pub(super) fn find_named_legs(body: &Body<'_>, findings: &mut Findings) -> bool {
    let mut found = Vec::new();
    for side in Side::BOTH {
        for (part, sense) in [(Part::FrontLeg, Sense::FrontLeg), (Part::HindLeg, Sense::HindLeg)] {
            let joints = body.candidates(Some(side), &[sense]);
            let [top] = body.topmost(&joints)[..] else { return false };
            let Some(path) = joints.last().and_then(|last| body.path(top, *last)) else { return false };
            found.push((Role::new(side, part), path));
        }
    }
    for (role, path) in found {
        findings.assign(role, &path, sure::NAMED, "its name says so");
    }
    true
}

/// Takes the legs away again: there are more than four.
pub(super) fn forget_legs(findings: &mut Findings) {
    for role in Side::BOTH.iter().flat_map(|side| [Part::FrontLeg, Part::HindLeg].map(|part| Role::new(*side, part))) {
        findings.remove(role);
    }
}

/// Whether limbs that are named like arms and legs carry a level trunk.
pub(super) fn stands_on_four(roles: &BTreeMap<Role, RoleFinding>, pose: &ModelPose) -> bool {
    let points = Points { roles, pose };
    let middle = |part: Part| points.pair(part).map(|(left, right)| left.midpoint(right));
    let directions = || {
        let (hips, shoulders) = (middle(Part::Thigh)?, middle(Part::UpperArm)?);
        let feet = middle(Part::Foot).or_else(|| middle(Part::Shin))?;
        let hands = middle(Part::Hand).or_else(|| middle(Part::Forearm))?;
        let unit = |from: DVec3, to: DVec3| (to - from).try_normalize();
        Some((unit(hips, shoulders)?, unit(hips, feet)?, unit(shoulders, hands)?))
    };
    directions().is_some_and(|(trunk, legs, arms)| {
        trunk.dot(legs).abs() < LEVEL_COSINE && arms.dot(legs) > ALIKE_COSINE && arms.dot(trunk).abs() < LEVEL_COSINE
    })
}

/// Turns arms into front legs and legs into hind legs.
pub(super) fn arms_to_legs(body: &Body<'_>, findings: &mut Findings) {
    for side in Side::BOTH {
        for (part, segments) in [(Part::FrontLeg, ARM), (Part::HindLeg, LEG)] {
            let taken: Vec<RoleFinding> =
                segments.iter().filter_map(|segment| findings.remove(Role::new(side, *segment))).collect();
            let (Some(first), Some(last)) = (taken.first(), taken.last()) else { continue };
            let (top, end) = (first.joints[0], last.joints[last.joints.len() - 1]);
            // Animals have more segments than words for them: `Foot02` goes on below `Foot01`.
            let extremities = body.candidates(Some(side), &[Sense::Foot, Sense::Hand, Sense::Toe]);
            let end = body.below(&extremities, end).last().copied().unwrap_or(end);
            let path = body.path(top, end).unwrap_or_else(|| vec![top]);
            let confidence = taken.iter().map(|finding| finding.confidence).fold(sure::DECIDED, f64::min);
            let reason = "named like a human's limb, but the trunk is level and it stands on the ground";
            findings.assign(Role::new(side, part), &path, confidence, reason);
        }
    }
}
