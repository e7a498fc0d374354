//! `copy_base_pose`: which joints have the same name on both sides.

use super::CopyDrive;
use std::collections::BTreeMap;

use crate::retarget::ops::{
    CopyBasePoseOp,
    context::{Context, is_in},
};

pub(in crate::retarget) fn resolve(op: &CopyBasePoseOp, context: &mut Context<'_>) -> Vec<CopyDrive> {
    let masked = context.masked(&op.scope);
    let top = match &op.below {
        None => None,
        Some(name) => match context.target_joint(name, "below") {
            None => return Vec::new(),
            found => found,
        },
    };
    let driven = context.mapping.driven();
    let mut sources: BTreeMap<&str, Option<usize>> = BTreeMap::new();
    for (index, joint) in context.source.skeleton().joints().iter().enumerate() {
        sources.entry(&joint.name).and_modify(|joint| *joint = None).or_insert(Some(index));
    }
    let skeleton = context.target.skeleton();
    let copies: Vec<CopyDrive> = (0..skeleton.len())
        .filter(|&joint| is_in(masked.as_ref(), joint) && (op.driven || !driven[joint]))
        .filter(|&joint| top.is_none_or(|top| skeleton.is_ancestor_or_self(top, joint)))
        .filter_map(|joint| {
            let name = skeleton.joints()[joint].name.as_str();
            // Names that several joints share say nothing.
            let is_unique = skeleton.joints().iter().filter(|other| other.name == name).count() == 1;
            let source = (*sources.get(name)?).filter(|_| is_unique && !name.is_empty())?;
            Some(CopyDrive { source, joint, position: op.position, rotation: op.rotation })
        })
        .collect();
    if copies.is_empty() {
        context.reporter.warn(
            "nothing_to_copy",
            context.pointer(""),
            "copy_base_pose found no joint of the target that has a namesake in the source and is not driven already",
            "set 'driven' to copy over what pelvis and fk drive, or look at 'below' and 'mask'",
        );
    }
    copies
}
