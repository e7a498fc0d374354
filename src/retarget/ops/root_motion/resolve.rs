//! `root_motion`: the roots.

use glam::DVec3;

use crate::{
    retarget::ops::{RootAction, RootAxis, RootMotionOp, RootSource, context::Subject, edits::RootMotion},
    rig::rig::Rig,
};

pub(in crate::retarget) fn resolve(op: &RootMotionOp, subject: &mut Subject<'_>) -> Option<RootMotion> {
    if op.action == RootAction::Keep {
        return None;
    }
    if op.scope.mask.is_some() {
        subject.refuse("mask", "root_motion is about the whole figure and has no mask; leave it out".to_owned());
        return None;
    }
    let Some(&pelvis) = subject.target.role("pelvis").first() else {
        subject.reporter.warn(
            "pelvis_not_found",
            "target",
            "no joint of the target was recognised as the pelvis; root_motion is left out",
            "name the joint in target.root",
        );
        return None;
    };
    let root = match op.action {
        RootAction::Extract => Some(target_root(op, pelvis, subject)?),
        RootAction::Remove | RootAction::Keep => None,
    };
    let source = match op.from {
        RootSource::Pelvis => None,
        RootSource::SourceRoot => Some(source_root(op, subject)?),
    };
    let has = |axis: RootAxis| if op.axes.contains(&axis) { 1.0 } else { 0.0 };
    Some(RootMotion {
        action: op.action,
        root,
        pelvis,
        source,
        axes: DVec3::new(has(RootAxis::Left), has(RootAxis::Up), has(RootAxis::Front)),
        turn: op.turn,
        place: op.place,
        smoothing_seconds: op.smoothing_seconds,
    })
}

fn target_root(op: &RootMotionOp, pelvis: usize, subject: &mut Subject<'_>) -> Option<usize> {
    if let Some(name) = &op.joint {
        let joint = subject.target_joint(name, "joint")?;
        if joint == pelvis || !subject.target.skeleton().is_ancestor_or_self(joint, pelvis) {
            subject.refuse("joint", format!("'{name}' does not carry the pelvis, so it cannot be its root"));
            return None;
        }
        return Some(joint);
    }
    let found = root_of(subject.target);
    if found.is_none() {
        no_root(subject, "target");
    }
    found
}

fn source_root(op: &RootMotionOp, subject: &mut Subject<'_>) -> Option<usize> {
    if let Some(name) = &op.source_joint {
        return subject.source_joint(name, "source_joint");
    }
    let found = root_of(subject.source);
    if found.is_none() {
        no_root(subject, "source");
    }
    found
}

/// The joint that was recognised as the root; else the one that carries the pelvis.
fn root_of(rig: &Rig<'_>) -> Option<usize> {
    let recognised = rig.role("root").last().copied();
    recognised.or_else(|| rig.role("pelvis").first().and_then(|&pelvis| rig.skeleton().parent(pelvis)))
}

fn no_root(subject: &mut Subject<'_>, side: &'static str) {
    subject.reporter.warn(
        "root_not_found",
        side,
        format!("no joint of the {side} carries the pelvis; root_motion is left out"),
        "use a rig with a root joint above the pelvis; 'action': 'remove' needs none",
    );
}
