//! `stretch_chain`: the chains that the mask names.

use super::ChainStretch;
use crate::rig::rig::Rig;
use crate::{
    retarget::ops::{StretchChainOp, context::Context},
    rig::{
        auto_map::roles_of,
        error::{SpecErrorKind, SpecField},
    },
};

pub(in crate::retarget) fn resolve(op: &StretchChainOp, context: &mut Context<'_>) -> Vec<ChainStretch> {
    let mut edits = Vec::new();
    for (position, name) in op.scope.mask.iter().flatten().enumerate() {
        let roles = roles_of(name);
        let of_roles =
            |side: &Rig<'_>| -> Vec<usize> { roles.iter().flat_map(|role| side.role(role).iter().copied()).collect() };
        let chain = context.mapping.chains.iter().find(|chain| chain.name == *name);
        let (source, mut target) = match chain.filter(|_| roles.len() == 1) {
            Some(chain) => (chain.source.clone(), chain.target.clone()),
            None => (of_roles(context.source), of_roles(context.target)),
        };
        target.sort_unstable();
        if target.len() < 2 {
            let detail = match target.len() {
                0 => format!("there is no chain, role or limb '{name}'"),
                _ => format!(
                    "'{name}' is a single joint, which has no bones to stretch; name the limb or a longer chain"
                ),
            };
            let pointer = context.pointer(&format!("mask/{position}"));
            let known = ["left_arm", "right_arm", "left_leg", "right_leg", "spine", "neck"];
            context.fields.push(SpecField::new(SpecErrorKind::UnknownName, pointer, detail).with_nearest(name, known));
            continue;
        }
        edits.push(ChainStretch { source, target, match_source: op.match_source, scale: op.scale });
    }
    edits
}
