//! `root_motion`: the roots.

use super::RootMotion;
use glam::DVec3;

use crate::{
    retarget::ops::{RootAction, RootAxis, RootMotionOp, RootSource, context::Context},
    rig::rig::Rig,
};

pub(in crate::retarget) fn resolve(op: &RootMotionOp, context: &mut Context<'_>) -> Option<RootMotion> {
    if op.action == RootAction::Keep {
        return None;
    }
    if op.scope.mask.is_some() {
        context.refuse("mask", "root_motion is about the whole figure and has no mask; leave it out".to_owned());
        return None;
    }
    let Some(&pelvis) = context.target.role("pelvis").first() else {
        context.reporter.warn(
            "pelvis_not_found",
            "target",
            "no joint of the target was recognized as the pelvis; root_motion is left out",
            "name the joint in target.root",
        );
        return None;
    };
    let root = match op.action {
        RootAction::Extract => Some(target_root(op, pelvis, context)?),
        RootAction::Remove | RootAction::Keep => None,
    };
    let source = match op.from {
        RootSource::Pelvis => None,
        RootSource::SourceRoot => Some(source_root(op, context)?),
    };
    let has = |axis: RootAxis| if op.axes.contains(&axis) { 1.0 } else { 0.0 };
    Some(RootMotion {
        root,
        pelvis,
        source,
        axes: DVec3::new(has(RootAxis::Left), has(RootAxis::Up), has(RootAxis::Front)),
        turn: op.turn,
        place: op.place,
        smoothing_seconds: op.smoothing_seconds,
    })
}

fn target_root(op: &RootMotionOp, pelvis: usize, context: &mut Context<'_>) -> Option<usize> {
    if let Some(name) = &op.joint {
        let joint = context.target_joint(name, "joint")?;
        if joint == pelvis || !context.target.skeleton().is_ancestor_or_self(joint, pelvis) {
            context.refuse("joint", format!("'{name}' does not carry the pelvis, so it cannot be its root"));
            return None;
        }
        return Some(joint);
    }
    let found = root_of(context.target);
    if found.is_none() {
        no_root(context, "target");
    }
    found
}

fn source_root(op: &RootMotionOp, context: &mut Context<'_>) -> Option<usize> {
    if let Some(name) = &op.source_joint {
        return context.source_joint(name, "source_joint");
    }
    let found = root_of(context.source);
    if found.is_none() {
        no_root(context, "source");
    }
    found
}

/// The joint that was recognized as the root; else the one that carries the pelvis.
fn root_of(rig: &Rig<'_>) -> Option<usize> {
    let recognized = rig.role("root").last().copied();
    recognized.or_else(|| rig.role("pelvis").first().and_then(|&pelvis| rig.skeleton().parent(pelvis)))
}

fn no_root(context: &mut Context<'_>, side: &'static str) {
    context.reporter.warn(
        "root_not_found",
        side,
        format!("no joint of the {side} carries the pelvis; root_motion is left out"),
        "use a rig with a root joint above the pelvis; 'action': 'remove' needs none",
    );
}
