//! Contacts that come with the source's clip.

use crate::model::{Clip, JointContacts, Skeleton};
use crate::retarget::mapping::LimbPair;

use crate::retarget::ops::ContactsOp;

/// Puts what the clip says of contacts into the op, beside what the spec says, which wins. A limb of which the clip says something
/// touches only when one of its points does by the clip; points of it that the clip does not name are looked for within that.
pub(in crate::retarget) fn take_contacts(op: &mut ContactsOp, limbs: &[LimbPair], skeleton: &Skeleton, clip: &Clip) {
    for pair in limbs {
        let mut known: [Option<Vec<bool>>; 3] = [None, None, None];
        for track in clip.contacts() {
            let Some(point) = point_of(pair, skeleton, track) else { continue };
            let touches = known[point].get_or_insert_with(|| vec![false; clip.frame_count()]);
            touches.iter_mut().zip(&track.touches).for_each(|(known, touches)| *known |= touches);
        }
        if known.iter().all(Option::is_none) {
            continue;
        }
        let is_free: Vec<bool> =
            (0..clip.frame_count()).map(|frame| known.iter().flatten().all(|touches| !touches[frame])).collect();
        for (name, known) in pair.limb.contact_points().into_iter().zip(&known).filter(|(name, _)| !name.is_empty()) {
            if op.set.contains_key(name) {
                continue;
            }
            match known {
                Some(touches) => {
                    op.set.insert(name.to_owned(), spans(touches, clip.times_seconds()));
                }
                None => op.remove.entry(name.to_owned()).or_default().extend(spans(&is_free, clip.times_seconds())),
            }
        }
    }
}

/// Which point of a limb a joint of the clip is: its end, the ball of the foot, or what is beyond.
fn point_of(pair: &LimbPair, skeleton: &Skeleton, track: &JointContacts) -> Option<usize> {
    let is_below = |joint: usize| skeleton.is_ancestor_or_self(joint, track.joint);
    let joints = &pair.source;
    match joints.ball {
        Some(ball) if track.joint == ball => Some(1),
        Some(ball) if is_below(ball) => Some(2),
        _ if track.joint == joints.end => Some(0),
        _ if is_below(joints.end) => Some(usize::from(pair.limb.is_leg())),
        _ => None,
    }
}

/// First and last times of the runs of frames in which something is so.
fn spans(flags: &[bool], times: &[f64]) -> Vec<[f64; 2]> {
    let mut spans: Vec<[f64; 2]> = Vec::new();
    for frame in (0..flags.len()).filter(|frame| flags[*frame]) {
        let continues = frame > 0 && flags[frame - 1];
        match spans.last_mut() {
            Some(span) if continues => span[1] = times[frame],
            _ => spans.push([times[frame]; 2]),
        }
    }
    spans
}
