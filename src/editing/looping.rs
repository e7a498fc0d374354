//! A clip that flows into itself, and repeats.

use glam::{DQuat, DVec3, Vec3};

use crate::{
    model::{Clip, JointContacts, JointTracks, MorphTrack, Skeleton, Track, Transform, Travel, rotation::smoothstep},
    retarget::{LoopRoot, LoopSpec},
};

use super::error::EditError;

/// How far the joint that carries the figure gets over the clip; `up` in its parent's space.
fn travel_of(tracks: &JointTracks, up: DVec3) -> Travel {
    let Track::Sampled(positions) = &tracks.translation else { return Travel::NONE };
    let at = |frame: usize| Transform {
        translation: positions[frame].as_dvec3(),
        rotation: tracks.rotation.wide_at(frame, DQuat::IDENTITY),
        ..Transform::IDENTITY
    };
    Travel::between(&at(0), &at(positions.len() - 1), up)
}

/// Bends the last `blend_seconds` toward the first frame, and plays the clip `times` times. The last frame of one pass is the first of the
/// next; it is there once.
///
/// Joints without animated translation keep theirs. Where the root travels, each pass begins where and in the direction that the one
/// before ended; heights and tilts flow into those of the start.
pub(super) fn make_loop(clip: &Clip, skeleton: &Skeleton, up: DVec3, rule: &LoopSpec) -> Result<Clip, EditError> {
    let frames = clip.frame_count();
    let duration = clip.duration_seconds();
    if frames < 2 || duration <= 0.0 {
        let detail = "a clip of a single frame cannot be looped";
        return Err(EditError::new("loop", detail, "leave 'loop' out, or take a longer range"));
    }
    let carrier = carrier(clip);
    let travel = match rule.root {
        LoopRoot::Restart => Travel::NONE,
        LoopRoot::Travel => carrier.map_or(Travel::NONE, |joint| {
            travel_of(&clip.joints()[joint], rotation_above(clip, skeleton, joint).conjugate() * up)
        }),
    };
    let start = clip.times_seconds()[0];
    let weights: Vec<f64> = clip
        .times_seconds()
        .iter()
        .map(|time| {
            let left = duration - (time - start);
            if rule.blend_seconds > left { smoothstep(1.0 - left / rule.blend_seconds.min(duration)) } else { 0.0 }
        })
        .collect();
    let times = rule.times as usize;
    let count = (frames - 1) * times + 1;
    let mut key_times = Vec::with_capacity(count);
    for pass in 0..times {
        let skip = usize::from(pass > 0);
        key_times.extend(clip.times_seconds()[skip..].iter().map(|time| time - start + pass as f64 * duration));
    }
    let passes: Vec<Travel> =
        std::iter::successors(Some(Travel::NONE), |before| Some(before.then(travel))).take(times).collect();
    let joints = clip.joints().iter().enumerate().map(|(joint, tracks)| {
        let (own, passes) = if carrier == Some(joint) { (travel, Some(&passes)) } else { (Travel::NONE, None) };
        JointTracks {
            translation: repeat(&tracks.translation, times, |values, frame, pass| {
                let (first, last) = (values[0].as_dvec3(), values[frames - 1].as_dvec3());
                let missing = own.place(first) - last;
                let value = values[frame].as_dvec3() + missing * weights[frame];
                passes.map_or(value, |passes| passes[pass].place(value)).as_vec3()
            }),
            rotation: repeat(&tracks.rotation, times, |values, frame, pass| {
                if weights[frame] == 0.0 && (pass == 0 || passes.is_none()) {
                    return values[frame];
                }
                let (first, last) = (values[0].as_dquat(), values[frames - 1].as_dquat());
                let missing = ((own.turn * first) * last.conjugate()).normalize();
                let bend = DQuat::IDENTITY.slerp(missing, weights[frame]);
                let value = bend * values[frame].as_dquat();
                passes.map_or(value, |passes| passes[pass].turn * value).normalize().as_quat()
            }),
            scale: repeat(&tracks.scale, times, |values, frame, _| {
                let missing = values[0].as_dvec3() - values[frames - 1].as_dvec3();
                (values[frame].as_dvec3() + missing * weights[frame]).as_vec3()
            }),
        }
    });
    let mut joints: Vec<JointTracks> = joints.collect();
    for tracks in &mut joints {
        tracks.rotation = std::mem::take(&mut tracks.rotation).on_one_hemisphere();
    }
    let morphs = clip.morphs().iter().map(|track| MorphTrack {
        morph: track.morph,
        weights: repeat(&track.weights, times, |values, frame, _| {
            let missing = f64::from(values[0]) - f64::from(values[frames - 1]);
            (f64::from(values[frame]) + missing * weights[frame]) as f32
        }),
    });
    let contacts = clip.contacts().iter().map(|track| JointContacts {
        joint: track.joint,
        touches: passes_of(times, frames).map(|(_, frame)| track.touches[frame]).collect(),
    });
    let looped = Clip::new(clip.name().to_owned(), key_times, joints)?;
    Ok(looped.with_morphs(morphs.collect())?.with_contacts(contacts.collect())?)
}

/// The first joint whose place is animated. Parents come before children, so it is the one that moves the figure.
pub(super) fn carrier(clip: &Clip) -> Option<usize> {
    let moves = |track: &Track<Vec3>| match track {
        Track::Sampled(values) => values.iter().any(|value| *value != values[0]),
        Track::Rest | Track::Constant(_) => false,
    };
    clip.joints().iter().position(|tracks| moves(&tracks.translation))
}

/// How the space that a joint's tracks are in lies in model space, where the joints above stand still.
fn rotation_above(clip: &Clip, skeleton: &Skeleton, joint: usize) -> DQuat {
    let mut rotation = DQuat::IDENTITY;
    let mut above = skeleton.parent(joint);
    while let Some(parent) = above {
        let rest = skeleton.joints()[parent].rest.rotation;
        let local = clip.joints()[parent].rotation.wide_at(0, rest);
        rotation = local * rotation;
        above = skeleton.parent(parent);
    }
    rotation.normalize()
}

fn repeat<T: Copy>(track: &Track<T>, times: usize, value: impl Fn(&[T], usize, usize) -> T) -> Track<T> {
    let Track::Sampled(values) = track else { return track.clone() };
    Track::Sampled(passes_of(times, values.len()).map(|(pass, frame)| value(values, frame, pass)).collect())
}

/// Which frame of which pass each frame of the repeated clip is; the first of a later pass is the last of the one before.
fn passes_of(times: usize, frames: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..times).flat_map(move |pass| (usize::from(pass > 0)..frames).map(move |frame| (pass, frame)))
}
