//! Helper joints of Unreal rigs, which follow hands and feet.
//!
//! The mannequins of Unreal Engine have joints below the root for its IK solvers and weapon sockets: `ik_foot_l`, `ik_hand_gun` and so
//! on. Nothing hangs from them and nothing of a source corresponds to them, but the engine expects them where feet and hands are.

use crate::{
    retarget::ops::{Op, Pin, PinMode, PinOp, PinSide},
    rig::rig::Rig,
};

/// The helpers and the roles of what they follow, parents first: hands hang from the gun in these rigs.
const HELPERS: [(&str, &str); 5] = [
    ("ik_foot_l", "left_foot"),
    ("ik_foot_r", "right_foot"),
    ("ik_hand_gun", "right_hand"),
    ("ik_hand_l", "left_hand"),
    ("ik_hand_r", "right_hand"),
];

/// The pins of the helpers that a target has; nothing where it has none.
pub(in crate::retarget) fn follow_helpers(target: &Rig<'_>) -> Option<Op> {
    let pins: Vec<Pin> = HELPERS.iter().filter_map(|(helper, role)| pin(target, helper, role)).collect();
    (!pins.is_empty()).then(|| Op::Pin(PinOp { pins, ..PinOp::default() }))
}

fn pin(target: &Rig<'_>, helper: &str, role: &str) -> Option<Pin> {
    let skeleton = target.skeleton();
    let mut found = (0..skeleton.len()).filter(|joint| is_called(&skeleton.joints()[*joint].name, helper));
    let (joint, end) = (found.next().filter(|_| found.next().is_none())?, *target.role(role).first()?);
    let has_role = target.roles.values().any(|joints| joints.contains(&joint));
    let name = skeleton.joints()[joint].name.clone();
    let is_free = !has_role && !skeleton.is_ancestor_or_self(joint, end) && skeleton.find(&name) == Some(joint);
    is_free.then(|| Pin {
        joint: name,
        to: role.to_owned(),
        side: PinSide::Target,
        mode: PinMode::Global,
        position: true,
        rotation: true,
        offset: [0.0; 3],
        rotation_offset: [0.0; 3],
        carries_children: true,
    })
}

/// Whether a joint has a name, in any letter case and in any namespace.
fn is_called(name: &str, helper: &str) -> bool {
    name.rsplit([':', '|']).next().is_some_and(|name| name.eq_ignore_ascii_case(helper))
}
