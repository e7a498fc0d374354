//! The solved rig as a pose: where its joints are, and how it stands on the floor.

use glam::{DQuat, DVec3};

use crate::model::{LocalPose, ModelPose, Transform};

use super::{
    super::super::{
        floor::{Stance, lowest_sole},
        rig::Rig,
    },
    super::RestSource,
    orientation::Laid,
    solve::base_of,
};

/// The rig with its joints turned. Bones keep their length; what belongs to the body and hangs elsewhere (feet below the root) goes
/// where the rest file has it, seen from the pelvis. The whole is moved along the vertical until the soles are as high as before,
/// or, where the rig's own rest pose is no pose that somebody laid out, as the rest file has them.
pub(super) fn posed(laid: &Laid<'_>, turns: &[DQuat]) -> LocalPose {
    let rig = laid.rig;
    let base = base_of(rig);
    let skeleton = rig.skeleton();
    let is_of_body = |joint: usize| base.is_none_or(|base| skeleton.is_ancestor_or_self(base, joint));
    let is_above = |joint: usize| base.is_some_and(|base| skeleton.is_ancestor_or_self(joint, base));
    let mut model: Vec<Transform> = Vec::with_capacity(turns.len());
    let mut moved = vec![false; turns.len()];
    for (joint, turn) in turns.iter().enumerate() {
        let local = &rig.rest_local.transforms()[joint];
        let parent = skeleton.parent(joint);
        let mut transform = parent.map_or(*local, |parent| model[parent].then_child(local));
        transform.rotation = (*turn * rig.rest.transforms()[joint].rotation).normalize();
        let hangs_elsewhere = !is_of_body(joint) && !is_above(joint) && parent.is_none_or(is_above);
        if let Some(place) = base.filter(|_| hangs_elsewhere).and_then(|base| place_of(laid, joint, base, &model)) {
            transform.translation = place;
            moved[joint] = true;
        }
        moved[joint] |= base == Some(joint);
        model.push(transform);
    }
    let placed = moved.clone();
    let mut pose = ModelPose::new(model);
    if let Some(base) = base {
        let shift = shift_to_floor(laid, &pose, base);
        for joint in 0..moved.len() {
            if moved[joint] || skeleton.parent(joint).is_some_and(|parent| moved[parent]) {
                moved[joint] = true;
                pose.transforms_mut()[joint].translation += shift;
            }
        }
    }
    as_local(rig, &pose, &placed)
}

/// Where the rest file has a joint, seen from the pelvis. Nothing where the pelvis is not placed yet, or one of them is not known.
fn place_of(laid: &Laid<'_>, joint: usize, base: usize, model: &[Transform]) -> Option<DVec3> {
    let anchors = &laid.matching.anchors;
    let (place, center) = (anchors[joint]?.place(&laid.rest.rest), anchors[base]?.place(&laid.rest.rest));
    let own = laid.rig.rest.transforms();
    let carrier = model.get(base).map_or(own[base].translation, |base| base.translation);
    let wanted = carrier + laid.rig_from_rest * (place - center) * laid.limbs.scale;
    // What is there already stays, to the last bit.
    let is_there = wanted.distance(own[joint].translation) < 1e-6 * (own[base].translation.length() + 1.0);
    (!is_there).then_some(wanted)
}

fn shift_to_floor(laid: &Laid<'_>, pose: &ModelPose, base: usize) -> DVec3 {
    let (rig, rest) = (laid.rig, laid.rest);
    let Some((before, after)) = lowest_sole(rig, &rig.rest, base).zip(lowest_sole(rig, pose, base)) else {
        return DVec3::ZERO;
    };
    let rest_sole = || {
        let pelvis = base_of(rest)?;
        let is_laid_out = !matches!(rig.rest_source, RestSource::StandingFrame | RestSource::Solved);
        let stands = !is_laid_out && !Stance::of(rig, base).stands && Stance::of(rest, pelvis).stands;
        lowest_sole(rest, &rest.rest, pelvis).filter(|_| stands)
    };
    let wanted = rest_sole().map_or(before, |sole| sole * laid.limbs.scale);
    rig.up() * (wanted - after)
}

/// The local pose. But for the joints that were placed, lengths are the rig's own, and so are all scales.
fn as_local(rig: &Rig<'_>, pose: &ModelPose, placed: &[bool]) -> LocalPose {
    let mut local = pose.to_local(rig.skeleton());
    for ((posed, own), is_placed) in local.transforms_mut().iter_mut().zip(rig.rest_local.transforms()).zip(placed) {
        posed.scale = own.scale;
        posed.rotation = posed.rotation.normalize();
        if !is_placed {
            posed.translation = own.translation;
        }
    }
    local
}
