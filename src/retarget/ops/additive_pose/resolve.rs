//! `additive_pose`: constant turns of joints.

use super::AddedTurn;
use std::collections::BTreeMap;

use glam::DQuat;

use crate::{
    retarget::ops::{
        AdditivePoseOp,
        context::{Context, is_in, turn},
    },
    rig::lookup::find_clip,
};

/// Turns of less than this are none, radians.
const MIN_TURN: f64 = 1e-6;

pub(in crate::retarget) fn resolve(op: &AdditivePoseOp, context: &mut Context<'_>) -> Vec<AddedTurn> {
    let masked = context.masked(&op.scope);
    let mut turns: BTreeMap<usize, DQuat> = BTreeMap::new();
    if let Some(choice) = &op.clip {
        match find_clip(context.target.scene, choice, "target", &context.pointer("clip")) {
            Err(field) => context.fields.push(field),
            Ok(clip) => turns.extend(turns_of_clip(op, clip, context)),
        }
    }
    for (name, degrees) in &op.degrees {
        for joint in context.joints_named(name, &format!("degrees/{name}")) {
            let before = turns.get(&joint).copied().unwrap_or(DQuat::IDENTITY);
            turns.insert(joint, before * turn(*degrees));
        }
    }
    let edits = turns.into_iter().filter(|(joint, _)| is_in(masked.as_ref(), *joint));
    edits.map(|(joint, turn)| AddedTurn { joint, turn }).collect()
}

/// What turns between the rest pose and a frame of a clip of the target.
fn turns_of_clip(op: &AdditivePoseOp, clip: usize, context: &mut Context<'_>) -> Vec<(usize, DQuat)> {
    let target = context.target;
    let clip = &target.scene.clips[clip];
    if op.frame >= clip.frame_count() {
        context.refuse("frame", format!("frame {} is past the clip's {} frames", op.frame, clip.frame_count()));
        return Vec::new();
    }
    let pose = clip.local_pose(target.skeleton(), op.frame);
    let change = |(rest, now): (&crate::model::Transform, &crate::model::Transform)| {
        (rest.rotation.conjugate() * now.rotation).normalize()
    };
    let changes = target.rest_local.transforms().iter().zip(pose.transforms()).map(change).enumerate();
    changes.filter(|(_, turn)| turn.angle_between(DQuat::IDENTITY) > MIN_TURN).collect()
}
