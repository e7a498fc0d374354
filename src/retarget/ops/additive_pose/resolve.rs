//! `additive_pose`: constant turns of joints.

use std::collections::BTreeMap;

use glam::DQuat;

use crate::{
    retarget::ops::{
        AdditivePoseOp,
        context::{Subject, is_in, turn},
        edits::PosedEdit,
    },
    rig::lookup::find_clip,
};

/// Turns of less than this are none, radians.
const LEAST_TURN: f64 = 1e-6;

pub(in crate::retarget) fn resolve(op: &AdditivePoseOp, subject: &mut Subject<'_>) -> Vec<PosedEdit> {
    let masked = subject.masked(&op.scope);
    let mut turns: BTreeMap<usize, DQuat> = BTreeMap::new();
    if let Some(choice) = &op.clip {
        match find_clip(subject.target.scene, choice, "target", &subject.pointer("clip")) {
            Err(field) => subject.fields.push(field),
            Ok(clip) => turns.extend(turns_of_clip(op, clip, subject)),
        }
    }
    for (name, degrees) in &op.degrees {
        for joint in subject.joints_named(name, &format!("degrees/{name}")) {
            let before = turns.get(&joint).copied().unwrap_or(DQuat::IDENTITY);
            turns.insert(joint, before * turn(*degrees));
        }
    }
    let edits = turns.into_iter().filter(|(joint, _)| is_in(masked.as_ref(), *joint));
    edits.map(|(joint, turn)| PosedEdit::Add { joint, turn }).collect()
}

/// What turns between the rest pose and a frame of a clip of the target.
fn turns_of_clip(op: &AdditivePoseOp, clip: usize, subject: &mut Subject<'_>) -> Vec<(usize, DQuat)> {
    let target = subject.target;
    let clip = &target.scene.clips[clip];
    if op.frame >= clip.frame_count() {
        subject.refuse("frame", format!("frame {} is past the clip's {} frames", op.frame, clip.frame_count()));
        return Vec::new();
    }
    let pose = clip.local_pose(target.skeleton(), op.frame);
    let change = |(rest, now): (&crate::model::Transform, &crate::model::Transform)| {
        (rest.rotation.conjugate() * now.rotation).normalize()
    };
    let changes = target.rest_local.transforms().iter().zip(pose.transforms()).map(change).enumerate();
    changes.filter(|(_, turn)| turn.angle_between(DQuat::IDENTITY) > LEAST_TURN).collect()
}
