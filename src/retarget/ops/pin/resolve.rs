//! `pin`: pins in indices.

use glam::DVec3;

use crate::retarget::ops::{
    PinOp, PinSide,
    context::{Subject, is_in, turn},
    edits::{PinDrive, PosedEdit},
};

pub(in crate::retarget) fn resolve(op: &PinOp, subject: &mut Subject<'_>) -> Vec<PosedEdit> {
    let masked = subject.masked(&op.scope);
    let mut edits = Vec::with_capacity(op.pins.len());
    for (index, pin) in op.pins.iter().enumerate() {
        let joint = subject.target_joint(&pin.joint, &format!("pins/{index}/joint"));
        let place = format!("pins/{index}/to");
        let to = match pin.side {
            PinSide::Source => subject.source_joint(&pin.to, &place),
            PinSide::Target => subject.target_joint(&pin.to, &place),
        };
        let (Some(joint), Some(to)) = (joint, to) else { continue };
        if pin.side == PinSide::Target && subject.target.skeleton().is_ancestor_or_self(joint, to) {
            let detail = format!("'{}' cannot follow '{}', which hangs below it", pin.joint, pin.to);
            subject.refuse(&place, detail);
            continue;
        }
        if is_in(masked.as_ref(), joint) {
            edits.push(PosedEdit::Pin(PinDrive {
                joint,
                to,
                side: pin.side,
                mode: pin.mode,
                position: pin.position,
                rotation: pin.rotation,
                offset: DVec3::from(pin.offset),
                rotation_offset: turn(pin.rotation_offset),
                carries_children: pin.carries_children,
            }));
        }
    }
    edits
}
