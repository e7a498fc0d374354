//! `pin`: pins in indices.

use super::PinDrive;
use glam::DVec3;

use crate::retarget::ops::{
    PinOp, PinSide,
    context::{Context, is_in, turn},
};

pub(in crate::retarget) fn resolve(op: &PinOp, context: &mut Context<'_>) -> Vec<PinDrive> {
    let masked = context.masked(&op.scope);
    let mut edits = Vec::with_capacity(op.pins.len());
    for (index, pin) in op.pins.iter().enumerate() {
        let joint = context.target_joint(&pin.joint, &format!("pins/{index}/joint"));
        let place = format!("pins/{index}/to");
        let to = match pin.side {
            PinSide::Source => context.source_joint(&pin.to, &place),
            PinSide::Target => context.target_joint(&pin.to, &place),
        };
        let (Some(joint), Some(to)) = (joint, to) else { continue };
        if pin.side == PinSide::Target && context.target.skeleton().is_ancestor_or_self(joint, to) {
            let detail = format!("'{}' cannot follow '{}', which hangs below it", pin.joint, pin.to);
            context.refuse(&place, detail);
            continue;
        }
        if is_in(masked.as_ref(), joint) {
            edits.push(PinDrive {
                joint,
                to,
                side: pin.side,
                mode: pin.mode,
                position: pin.position,
                rotation: pin.rotation,
                offset: DVec3::from(pin.offset),
                rotation_offset: turn(pin.rotation_offset),
                carries_children: pin.carries_children,
            });
        }
    }
    edits
}
