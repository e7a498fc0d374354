//! `arm_spacing`: the arms, and the chests that they hang from.

use super::SpacedArm;
use crate::{
    retarget::ops::{
        ArmSpacingOp,
        context::{Context, is_in},
    },
    rig::anatomy::carriers,
};

pub(in crate::retarget) fn resolve(op: &ArmSpacingOp, context: &mut Context<'_>) -> Vec<SpacedArm> {
    let masked = context.masked(&op.scope);
    let carriers = carriers(context.target);
    let chest = context.target.role("spine").last().or_else(|| context.target.role("pelvis").last()).copied();
    let arm = |(role, sign): (&str, f64)| {
        let joint = *context.target.role(role).first()?;
        let chest = chest.or_else(|| carriers.get(&joint).copied())?;
        let edit = SpacedArm { joint, chest, radians: sign * op.degrees.to_radians() };
        is_in(masked.as_ref(), joint).then_some(edit)
    };
    // About the front, the left arm goes away from the body by turning from left to up.
    let edits: Vec<SpacedArm> =
        [("left_upper_arm", 1.0), ("right_upper_arm", -1.0)].into_iter().filter_map(arm).collect();
    if edits.is_empty() {
        context.reporter.warn(
            "arms_not_found",
            context.pointer(""),
            "arm_spacing found no arms on the target",
            "name the joints in target.roles.left_upper_arm and target.roles.right_upper_arm",
        );
    }
    edits
}
