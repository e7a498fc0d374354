//! `scale_source`: what the source is scaled by, and about which point.

use super::SourceScale;
use crate::{
    retarget::ops::{Alpha, ScaleSourceOp},
    rig::{
        error::{SpecErrorKind, SpecField},
        floor::Stance,
        rig::Rig,
    },
};

/// What the source is scaled by, on top of what an op before says.
pub(in crate::retarget) fn resolve(
    op: &ScaleSourceOp,
    index: usize,
    source: &Rig<'_>,
    before: Option<SourceScale>,
    fields: &mut Vec<SpecField>,
) -> Option<SourceScale> {
    let mut refuse = |place: &str, detail: &str| {
        fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("/ops/{index}/{place}"), detail));
    };
    if op.scope.mask.is_some() || op.scope.frames.is_some() || op.scope.alpha != Alpha::ALL {
        refuse("", "scale_source is about the whole clip: it has no alpha, mask and frames");
    }
    if before.is_some() {
        refuse("", "the source is scaled once; there is a scale_source before this one");
    }
    let pivot = op.pivot.as_ref().and_then(|name| match source.joint(name, &format!("/ops/{index}/pivot")) {
        Ok(joint) => Some(joint),
        Err(field) => {
            let role = source.role(name).first().copied();
            if role.is_none() {
                fields.push(field);
            }
            role
        }
    });
    Some(SourceScale { factor: op.factor, pivot, up: source.up(), floor: floor_of(source).filter(|_| op.on_floor) })
}

/// Height of the floor below a rig, in the scene's unit.
fn floor_of(rig: &Rig<'_>) -> Option<f64> {
    let pelvis = *rig.role("pelvis").first()?;
    Some(Stance::of(rig, pelvis).floor)
}
