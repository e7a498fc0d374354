//! Clips: whether there are any, and what is odd about them.

use glam::Vec3;

use super::{Finding, FindingCode};
use crate::model::{Clip, JointTracks, Scene, Track};

/// A clip whose first key is later than this does not begin at its beginning.
const LATE_SECONDS: f64 = 0.1;
/// When more than this share of the tracks holds one value, the clip was baked without looking.
const CONSTANT_SHARE: f64 = 0.5;
/// Fewer tracks than this are not worth a word.
const FEW_TRACKS: usize = 20;
/// Scales closer together than this are the same.
const SAME_SCALE: f32 = 1e-3;
/// A bone that changes by less than this share of its length does not stretch.
const STRETCH_SHARE: f64 = 0.01;

pub(super) fn examine(scene: &Scene, found: &mut Vec<Finding>) {
    if scene.clips.is_empty() {
        let detail = "there is no clip in the file".to_owned();
        found.push(Finding { code: FindingCode::NoAnimation, place: String::new(), detail });
    }
    for (code, look) in LOOKS {
        let seen: Vec<(&Clip, String)> =
            scene.clips.iter().filter_map(|clip| Some((clip, look(scene, clip)?))).collect();
        let Some((clip, detail)) = seen.first() else { continue };
        let more =
            if seen.len() > 1 { format!(" (and the same in {} more clips)", seen.len() - 1) } else { String::new() };
        found.push(Finding { code, place: clip.name().to_owned(), detail: format!("{detail}{more}") });
    }
}

type Look = fn(&Scene, &Clip) -> Option<String>;

const LOOKS: [(FindingCode, Look); 6] = [
    (FindingCode::ClipStill, still),
    (FindingCode::ClipOneFrame, one_frame),
    (FindingCode::ClipStartsLate, starts_late),
    (FindingCode::TracksConstant, constant),
    (FindingCode::ScaleAnimated, scale),
    (FindingCode::BonesStretch, stretch),
];

fn still(_: &Scene, clip: &Clip) -> Option<String> {
    let frames = clip.frame_count();
    (frames > 1 && !moves(clip)).then(|| format!("{frames} frames, in which nothing moves"))
}

fn moves(clip: &Clip) -> bool {
    let sampled = |tracks: &JointTracks| {
        [tracks.translation.sample_count(), tracks.rotation.sample_count(), tracks.scale.sample_count()]
    };
    clip.joints().iter().flat_map(sampled).any(|count| count.is_some())
}

fn one_frame(_: &Scene, clip: &Clip) -> Option<String> {
    (clip.frame_count() == 1).then(|| format!("one frame, at {:.3} s", clip.times_seconds()[0]))
}

fn starts_late(_: &Scene, clip: &Clip) -> Option<String> {
    let first = clip.times_seconds()[0];
    (first > LATE_SECONDS && clip.frame_count() > 1).then(|| format!("the first key is at {first:.3} s"))
}

fn constant(_: &Scene, clip: &Clip) -> Option<String> {
    let is_constant = |tracks: &JointTracks| {
        [
            (tracks.translation.is_animated(), tracks.translation.sample_count()),
            (tracks.rotation.is_animated(), tracks.rotation.sample_count()),
            (tracks.scale.is_animated(), tracks.scale.sample_count()),
        ]
    };
    let animated: Vec<bool> =
        clip.joints().iter().flat_map(is_constant).filter(|track| track.0).map(|track| track.1.is_none()).collect();
    let (all, idle) = (animated.len(), animated.iter().filter(|idle| **idle).count());
    let worth = moves(clip) && all >= FEW_TRACKS && idle as f64 > all as f64 * CONSTANT_SHARE;
    worth.then(|| format!("{idle} of {all} tracks hold one value"))
}

fn scale(scene: &Scene, clip: &Clip) -> Option<String> {
    let changes = |tracks: &JointTracks| match &tracks.scale {
        Track::Sampled(values) => values.iter().any(|value| (*value - values[0]).abs().max_element() > SAME_SCALE),
        Track::Rest | Track::Constant(_) => false,
    };
    let joints: Vec<usize> = (0..clip.joints().len()).filter(|joint| changes(&clip.joints()[*joint])).collect();
    let first = joints.first()?;
    Some(format!("the scale of {} changes, the first is '{}'", count(joints.len()), scene.skeleton.label(*first)))
}

/// Only below joints that hang from joints: roots and the pelvis travel.
fn stretch(scene: &Scene, clip: &Clip) -> Option<String> {
    let skeleton = &scene.skeleton;
    let depth = |joint: usize| {
        let (mut depth, mut current) = (0, skeleton.parent(joint));
        while let Some(above) = current.filter(|above| skeleton.joints()[*above].is_joint) {
            depth += 1;
            current = skeleton.parent(above);
        }
        depth
    };
    let changes = |joint: usize| {
        let Track::Sampled(values) = &clip.joints()[joint].translation else { return false };
        let length = |value: &Vec3| f64::from(value.length());
        let lengths = values.iter().map(length);
        let (low, high) =
            lengths.fold((f64::INFINITY, 0.0_f64), |(low, high), length| (low.min(length), high.max(length)));
        high - low > high * STRETCH_SHARE && high > 1e-6
    };
    let stretches = |joint: &usize| skeleton.joints()[*joint].is_joint && changes(*joint) && depth(*joint) >= 2;
    let joints: Vec<usize> = (0..clip.joints().len().min(skeleton.len())).filter(stretches).collect();
    let first = joints.first()?;
    Some(format!(
        "the distance of {} to their parents changes, the first is '{}'",
        count(joints.len()),
        skeleton.label(*first)
    ))
}

fn count(joints: usize) -> String {
    if joints == 1 { "one joint".to_owned() } else { format!("{joints} joints") }
}
