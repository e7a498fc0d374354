//! Limbs: connected, bent the right way, as long as their twins.

use glam::DVec3;

use super::{Finding, FindingCode, places};
use crate::rig::{Rig, RigKind};

/// A knee that leans back by more than this is bent the wrong way; less is drawing.
const KNEE_RADIANS: f64 = 0.05;
/// The same for an elbow, which hyperextends a little in many people.
const ELBOW_RADIANS: f64 = 0.12;
/// A bone that differs by more than this share from its twin is of another length.
const UNEVEN_SHARE: f64 = 0.03;

/// A bone shorter than this share of the limb's other bone has no length.
const NO_LENGTH_SHARE: f64 = 0.01;
/// A bone longer than this many times the limb's other bone is no bone of that limb.
const IMPLAUSIBLE_RATIO: f64 = 4.0;

/// Limbs by the roles of their parts, from the body outward.
const LIMBS: [(&str, [&str; 3]); 2] = [("arm", ["upper_arm", "forearm", "hand"]), ("leg", ["thigh", "shin", "foot"])];

pub(super) fn examine(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    if rig.recognition.kind != RigKind::Biped {
        return;
    }
    examine_connections(rig, found);
    examine_completeness(rig, found);
    examine_bones(rig, found);
    examine_bends(rig, found);
    examine_lengths(rig, found);
}

fn joint(rig: &Rig<'_>, side: &str, part: &str) -> Option<usize> {
    rig.role(&format!("{side}_{part}")).first().copied()
}

fn place(rig: &Rig<'_>, joint: usize) -> DVec3 {
    rig.rest.transforms()[joint].translation
}

fn examine_connections(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let skeleton = rig.skeleton();
    let mut loose = Vec::new();
    for side in ["left", "right"] {
        for (limb, parts) in LIMBS {
            let body = rig.role(if limb == "leg" { "pelvis" } else { "spine" }).first().copied();
            let mut above = body;
            for part in parts {
                let Some(own) = joint(rig, side, part) else { continue };
                if above.is_some_and(|above| !skeleton.is_ancestor_or_self(above, own)) {
                    loose.push(own);
                }
                above = Some(own);
            }
        }
    }
    found.extend(places::about(rig, FindingCode::LimbDisconnected, &loose, |count| {
        format!("{count} of a limb that do not hang from the part before them")
    }));
}

/// Every segment of a limb that goes on is there, limbs do not end at the knee or elbow, and no limb hangs from another.
fn examine_completeness(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let skeleton = rig.skeleton();
    let mut on_limb = Vec::new();
    for (side, other) in [("left", "right"), ("right", "left")] {
        for (index, (limb, parts)) in LIMBS.into_iter().enumerate() {
            let joints = parts.map(|part| joint(rig, side, part));
            let twins = parts.map(|part| joint(rig, other, part));
            let last = joints.iter().rposition(Option::is_some);
            for (place, part) in parts.iter().enumerate() {
                let part = part.replace('_', " ");
                let next = joints[place..].iter().flatten().next();
                if let (None, Some(next)) = (joints[place], next) {
                    let detail = format!("the {side} {limb} has no {part}");
                    found.push(Finding { code: FindingCode::LimbIncomplete, place: places::label(rig, *next), detail });
                }
            }
            // Robots and toys may have no hands and no feet, on both sides.
            let end = twins.iter().rposition(Option::is_some);
            if last < end {
                let at = last.and_then(|last| joints[last]).or(twins[0]).or(twins[1]).or(twins[2]);
                let missing = parts[last.map_or(0, |last| last + 1)].replace('_', " ");
                let detail = format!("the {side} {limb} has no {missing}, the {other} one has");
                let place = at.map_or_else(String::new, |joint| places::label(rig, joint));
                found.push(Finding { code: FindingCode::LimbCutOff, place, detail });
            } else if last == Some(0) && side == "left" {
                let place = joints[0].map_or_else(String::new, |joint| places::label(rig, joint));
                let detail = format!("the {limb}s end with their first segment");
                found.push(Finding { code: FindingCode::LimbCutOff, place, detail });
            }
            let others =
                ["left", "right"].into_iter().flat_map(|side| LIMBS[1 - index].1.map(|part| joint(rig, side, part)));
            let first = joints.iter().flatten().next();
            if let Some(first) = first.filter(|first| {
                others.flatten().any(|above| above != **first && skeleton.is_ancestor_or_self(above, **first))
            }) {
                on_limb.push(*first);
            }
        }
    }
    found.extend(places::about(rig, FindingCode::LimbOnLimb, &on_limb, |count| {
        format!("{count} where a limb begins, below a joint of another limb")
    }));
}

/// The bones of a limb have a length, and none is many times the other.
fn examine_bones(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let (mut without_length, mut implausible) = (Vec::new(), Vec::new());
    for side in ["left", "right"] {
        for (_, parts) in LIMBS {
            let [Some(start), Some(middle), Some(end)] = parts.map(|part| joint(rig, side, part)) else { continue };
            let (upper, lower) =
                (place(rig, start).distance(place(rig, middle)), place(rig, middle).distance(place(rig, end)));
            let (shorter, longer) = (upper.min(lower), upper.max(lower));
            if longer <= 0.0 || shorter < NO_LENGTH_SHARE * longer {
                without_length.push(if upper < lower { middle } else { end });
            } else if longer > IMPLAUSIBLE_RATIO * shorter {
                implausible.push(if upper < lower { end } else { middle });
            }
        }
    }
    found.extend(places::about(rig, FindingCode::BoneWithoutLength, &without_length, |count| {
        format!("{count} in the place of the joint before")
    }));
    found.extend(places::about(rig, FindingCode::BoneImplausible, &implausible, |count| {
        format!(
            "{count} more than {IMPLAUSIBLE_RATIO} times as far from the one before as the limb's other bone is long"
        )
    }));
}

/// A knee lies in front of the line from hip to ankle, an elbow behind the line from shoulder to wrist.
fn examine_bends(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let Some(body) = &rig.recognition.body else { return };
    for (parts, code, least, bends_forward) in [
        (LIMBS[1].1, FindingCode::KneeBackwards, KNEE_RADIANS, true),
        (LIMBS[0].1, FindingCode::ElbowBackwards, ELBOW_RADIANS, false),
    ] {
        let mut wrong: Vec<(usize, f64)> = Vec::new();
        for side in ["left", "right"] {
            let joints = parts.map(|part| joint(rig, side, part));
            let [Some(start), Some(middle), Some(end)] = joints else { continue };
            let (upper, lower) = (place(rig, middle) - place(rig, start), place(rig, end) - place(rig, middle));
            let (Some(upper), Some(lower)) = (upper.try_normalize(), lower.try_normalize()) else { continue };
            let angle = upper.angle_between(lower);
            // Which way the middle is off the straight line.
            let bulge = (upper - lower).try_normalize().map_or(0.0, |bulge| bulge.dot(body.forward));
            let backwards = if bends_forward { -bulge } else { bulge };
            // A limb that bends sideways or up is drawn like that; only what clearly bends the wrong way counts.
            if angle > least && backwards > 0.7 {
                wrong.push((middle, angle.to_degrees()));
            }
        }
        let joints: Vec<usize> = wrong.iter().map(|(joint, _)| *joint).collect();
        let most = wrong.iter().map(|(_, angle)| *angle).fold(0.0, f64::max);
        found.extend(places::about(rig, code, &joints, |_| format!("bent the wrong way by {most:.0}° at rest")));
    }
}

fn examine_lengths(rig: &Rig<'_>, found: &mut Vec<Finding>) {
    let mut uneven = Vec::new();
    let mut worst: Option<(f64, String)> = None;
    for (_, parts) in LIMBS {
        for bone in parts.windows(2) {
            let length = |side: &str| {
                let (start, end) = (joint(rig, side, bone[0])?, joint(rig, side, bone[1])?);
                Some((start, place(rig, start).distance(place(rig, end))))
            };
            let (Some((left, left_length)), Some((_, right_length))) = (length("left"), length("right")) else {
                continue;
            };
            let longer = left_length.max(right_length);
            let share = if longer > 0.0 { (left_length - right_length).abs() / longer } else { 0.0 };
            if share > UNEVEN_SHARE {
                uneven.push(left);
                if worst.as_ref().is_none_or(|(most, _)| share > *most) {
                    worst = Some((share, bone[0].replace('_', " ")));
                }
            }
        }
    }
    if let Some((share, part)) = worst {
        found.extend(places::about(rig, FindingCode::LimbsUneven, &uneven, |_| {
            format!("the {part} is {:.0} % longer on one side than on the other", share * 100.0)
        }));
    }
}
