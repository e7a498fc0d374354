//! Results of the parts of a clip, put one behind the other.

use super::stages::{ContactTrack, LimbReach, LimitedJoint, StackResult, result::seconds_of};
use crate::model::{Clip, ClipError, JointTracks, Track, Transform};

/// One result of all parts, in their order. `rest` are the rest transforms of the target's joints.
///
/// A contact ends where a part does: what touches behind a cut has come to stand elsewhere.
///
/// # Errors
/// When the times of the parts do not rise.
pub(super) fn joined(parts: Vec<StackResult>, rest: &[Transform]) -> Result<StackResult, ClipError> {
    let frames: Vec<usize> = parts.iter().map(|part| part.clip.frame_count()).collect();
    let name = parts.first().map_or_else(String::new, |part| part.clip.name().to_owned());
    let times: Vec<f64> = parts.iter().flat_map(|part| part.clip.times_seconds()).copied().collect();
    let joint = |(joint, rest): (usize, &Transform)| {
        let tracks = || parts.iter().map(move |part| &part.clip.joints()[joint]);
        JointTracks {
            translation: track(tracks().map(|tracks| &tracks.translation), &frames, rest.translation.as_vec3()),
            rotation: track(tracks().map(|tracks| &tracks.rotation), &frames, rest.rotation.as_quat())
                .on_one_hemisphere(),
            scale: track(tracks().map(|tracks| &tracks.scale), &frames, rest.scale.as_vec3()),
        }
    };
    let joints = rest.iter().enumerate().map(joint).collect();
    let (mut contacts, mut reaches, mut limited, mut first) = (Vec::new(), Vec::new(), Vec::new(), 0);
    for (part, frames) in parts.into_iter().zip(frames) {
        add_contacts(&mut contacts, part.contacts);
        add_reaches(&mut reaches, part.reaches, first, [first, frames]);
        add_limited(&mut limited, part.limited, first);
        first += frames;
    }
    for track in &mut contacts {
        track.seconds = seconds_of(&track.touches, &times);
    }
    let clip = Clip::new(name, times, joints)?;
    Ok(StackResult { clip, contacts, reaches, limited })
}

/// The values of all parts; one value where that is what all of them have.
fn track<'a, T: Copy + PartialEq + 'a>(
    parts: impl Iterator<Item = &'a Track<T>> + Clone,
    frames: &[usize],
    rest: T,
) -> Track<T> {
    let mut known = parts.clone();
    let first = known.next();
    if let Some(first @ (Track::Rest | Track::Constant(_))) = first
        && known.all(|part| part == first)
    {
        return first.clone();
    }
    let values = parts.zip(frames).flat_map(|(part, frames)| (0..*frames).map(move |frame| part.at(frame, rest)));
    Track::Sampled(values.collect())
}

fn add_contacts(all: &mut Vec<ContactTrack>, more: Vec<ContactTrack>) {
    if all.is_empty() {
        *all = more;
        return;
    }
    // All parts were moved by the same ops, which look at the same points.
    for (track, more) in all.iter_mut().zip(more) {
        let meets = more.touches.first().is_some_and(|touches| *touches);
        if let Some(last) = track.touches.last_mut() {
            *last &= !meets;
        }
        track.touches.extend(more.touches);
    }
}

/// Adds how limbs reached their goals in a section that begins so late; how many frames are known, and how many the section has.
pub(crate) fn add_reaches(
    all: &mut Vec<LimbReach>,
    section: Vec<LimbReach>,
    first_frame: usize,
    [frames, others]: [usize; 2],
) {
    for reach in section {
        match all.iter_mut().find(|known| known.limb == reach.limb) {
            Some(known) => *known = known.clone().with_section(&reach, first_frame, [frames, others]),
            None => all.push(LimbReach { worst_frame: reach.worst_frame + first_frame, ..reach }),
        }
    }
}

/// Adds what was taken back at joints in a section that begins so late.
pub(crate) fn add_limited(all: &mut Vec<LimitedJoint>, section: Vec<LimitedJoint>, first_frame: usize) {
    for joint in section {
        match all.iter_mut().find(|known| known.joint == joint.joint) {
            Some(known) => *known = known.with_section(joint, first_frame),
            None => all.push(LimitedJoint { worst_frame: joint.worst_frame + first_frame, ..joint }),
        }
    }
}
