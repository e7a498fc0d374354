//! A character put into a pose: a T pose, an A pose, or another character's rest pose.

use crate::model::LocalPose;

use super::{
    alignment::{AlignedJoint, Alignment, CanonicalPose, align, canonical_rest},
    auto_map::by_role,
    rig::Rig,
    spec::{Align, PoseChoice},
};

/// A rig in a pose.
#[derive(Clone, Debug)]
pub struct Posed {
    /// Local, of the rig's skeleton, in its scene's space and unit.
    pub pose: LocalPose,
    /// How well it was reached, by joint; empty where the rest pose itself was asked for.
    pub alignment: Vec<AlignedJoint>,
}

/// Puts a rig into a pose. Soles stay as high as they are at rest; only the pelvis is moved.
///
/// Nothing where the pose is to be taken from a source and there is none.
#[must_use]
pub fn posed_target(source: Option<&Rig<'_>>, target: &Rig<'_>, choice: PoseChoice, mode: Align) -> Option<Posed> {
    let from_nothing = target.recognition.body.is_none();
    let Alignment { rest, joints } = match choice {
        PoseChoice::Rest => return Some(Posed { pose: target.rest_local.clone(), alignment: Vec::new() }),
        PoseChoice::T => canonical_rest(target, CanonicalPose::T, from_nothing),
        PoseChoice::A => canonical_rest(target, CanonicalPose::A, from_nothing),
        PoseChoice::Source => {
            let source = source?;
            align(source, target, &by_role(source, target), mode)
        }
    };
    Some(Posed { pose: rest.to_local(target.skeleton()), alignment: joints })
}
