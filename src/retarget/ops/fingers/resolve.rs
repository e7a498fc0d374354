//! `fingers`: about which axes the joints of fingers bend.

use super::FingerDrive;
use glam::DVec3;

use crate::{
    retarget::ops::{
        FingersOp,
        context::{Context, is_in},
    },
    rig::rig::Rig,
};

/// Fingers whose first joints lie in the line of the knuckles, from the thumb's side.
const FINGERS: [&str; 4] = ["index", "middle", "ring", "pinky"];

pub(in crate::retarget) fn resolve(op: &FingersOp, context: &mut Context<'_>) -> Vec<FingerDrive> {
    let masked = context.masked(&op.scope);
    let target = context.target;
    let mut drives = Vec::new();
    for side in ["left_", "right_"] {
        let hand = target.role(&format!("{side}hand")).first().copied();
        // A hand stands for its fingers.
        let is_wanted =
            |joint: usize| is_in(masked.as_ref(), joint) || hand.is_some_and(|hand| is_in(masked.as_ref(), hand));
        let knuckles = knuckles(target, side);
        for finger in ["thumb"].into_iter().chain(FINGERS) {
            let joints = target.role(&format!("{side}{finger}"));
            for (position, &joint) in joints.iter().enumerate().filter(|(_, joint)| is_wanted(**joint)) {
                let axes = knuckles.filter(|_| finger != "thumb").and_then(|line| axes(target, joints, position, line));
                drives.push(FingerDrive {
                    joint,
                    axes,
                    curl: op.curl,
                    spread: if position == 0 { op.spread } else { 1.0 },
                    curl_offset: op.curl_offset.to_radians(),
                });
            }
        }
    }
    if drives.is_empty() {
        context.reporter.warn(
            "fingers_not_found",
            context.pointer(""),
            "fingers found no fingers on the target that the mask names",
            "name the joints in target.roles, as in left_index",
        );
    }
    drives.sort_by_key(|drive| drive.joint);
    drives
}

/// The line of the knuckles, so that fingers bend toward the palm about it: from index to pinky on the left, the other way on the
/// right.
fn knuckles(target: &Rig<'_>, side: &str) -> Option<DVec3> {
    let first = |finger: &&str| target.role(&format!("{side}{finger}")).first().copied();
    let place = |joint: usize| target.rest.transforms()[joint].translation;
    let found: Vec<usize> = FINGERS.iter().filter_map(first).collect();
    let line = place(*found.last()?) - place(*found.first()?);
    let line = if side == "left_" { line } else { -line };
    line.try_normalize()
}

/// Along the bone and what it bends about, in the joint's own axes.
fn axes(target: &Rig<'_>, joints: &[usize], position: usize, line: DVec3) -> Option<[DVec3; 2]> {
    let place = |joint: usize| target.rest.transforms()[joint].translation;
    let joint = joints[position];
    let (from, to) = match joints.get(position + 1) {
        Some(next) => (joint, *next),
        None => (*joints.get(position.checked_sub(1)?)?, joint),
    };
    let along = (place(to) - place(from)).try_normalize()?;
    let flexion = (line - along * line.dot(along)).try_normalize()?;
    let own = target.rest.transforms()[joint].rotation.conjugate();
    Some([own * along, own * flexion])
}
