//! A clip of any rig as the motion of a body that drives drawings.

use glam::DVec3;

use crate::{
    drawing::{BodyMotion, DrawSpec, body_joints},
    engine::{
        Failure, FailureCode, Knowledge, NamedBytes, RigFacts,
        edit::edited_clip,
        files::{chosen_clip, in_config_or, load},
    },
    formats::Limits,
    model::{Clip, Control, Reporter},
    retarget::RetargetSpec as SpaceSpec,
    rig::Rig,
};

/// Pictures of drawings that are made for a second of motion, at most, where nobody asks for more.
const MAX_FPS: f64 = 30.0;

/// Which joints of a rig are looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Joints {
    /// Those by which a body is known, by the names of [`body_joints`].
    OfBody,
    /// The same, and all others by their own names.
    All,
}

/// A motion, and what was chosen.
pub(super) struct DrawnMotion {
    pub(super) body: BodyMotion,
    /// A sentence.
    pub(super) chosen: String,
    pub(super) facts: RigFacts,
}

/// The motion of a file.
///
/// # Errors
/// When the file cannot be read, moves nothing, or shows no body.
pub(super) fn drawn_motion(
    file: NamedBytes<'_>,
    which: Joints,
    spec: &DrawSpec,
    (knowledge, limits): (&Knowledge, &Limits),
    control: &Control,
    reporter: &mut Reporter,
) -> Result<DrawnMotion, Failure> {
    let loaded = load(file, "source", limits, control, reporter)?;
    let space = SpaceSpec {
        source: spec.source.clone(),
        clip: spec.clip.clone(),
        edit: spec.edit.clone(),
        ..SpaceSpec::default()
    };
    let no_body = |detail: String| {
        Failure::new(FailureCode::InvalidValue, format!("{}: {detail}", file.name)).in_part("source").with_hint(
            "'retargetd inspect FILE' says what was recognized; a drawing is driven by a body with two arms or two legs",
        )
    };
    if loaded.scene.skeleton.is_empty() {
        return Err(no_body("the file has no skeleton".to_owned()));
    }
    let rig = Rig::with_recognizer("source", &loaded.scene, None, &space.source, knowledge.recognizer(), reporter)
        .map_err(|error| in_config_or(error, "source"))?;
    let clip = chosen_clip(&space, &loaded.scene, reporter, || {
        let failure = Failure::new(FailureCode::NoAnimation, format!("{}: nothing moves in the file", file.name));
        failure.in_part("source").with_hint("give a file with a clip")
    })?;
    let clip = edited_clip(&rig, clip, &space, control, reporter)?;
    let joints = joints(&rig, which);
    if joints.first().is_none_or(|(name, _)| name != "pelvis") {
        return Err(no_body("no body was recognized".to_owned()));
    }
    let place = |name: &str| joints.iter().position(|(other, _)| other == name);
    let pair = |name: &str| Some((place(&format!("left_{name}"))?, place(&format!("right_{name}"))?));
    let pairs: Vec<(usize, usize)> = ["upper_arm", "thigh"].into_iter().filter_map(pair).collect();
    if pairs.is_empty() {
        return Err(no_body("no pair of arms or legs was recognized".to_owned()));
    }
    let (frames, frame_time) = frames(&clip, spec.edit.fps.is_some());
    if frames.len() > crate::drawing::MAX_VIDEO_FRAMES {
        let most = crate::drawing::MAX_VIDEO_FRAMES;
        let detail =
            format!("{}: the motion has {} frames; the limit 'video_frames' is {most}", file.name, frames.len());
        return Err(Failure::new(FailureCode::AssetLimitExceeded, detail)
            .in_part("source")
            .with_hint("take a part of it with edit.range, or a lower rate with edit.fps"));
    }
    let mut places = Vec::with_capacity(frames.len());
    for frame in frames {
        control.check()?;
        let model = clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton());
        let place = |joint: usize| rig.canonical_from_scene * model.transforms()[joint].translation * rig.unit_meters;
        places.push(joints.iter().map(|(_, joint)| place(*joint)).collect::<Vec<DVec3>>());
    }
    let names = joints.iter().map(|(name, _)| name.clone()).collect();
    let body = BodyMotion::of_places(names, frame_time, pairs, &places)
        .map_err(|error| Failure::new(FailureCode::InvalidValue, error.in_file(file.name).to_string()))?;
    let clip_name = if clip.name().is_empty() { "its clip".to_owned() } else { format!("clip '{}'", clip.name()) };
    let count = body_joints().iter().filter(|name| place(name).is_some()).count();
    let chosen = format!("{clip_name}, {} frames of {:.4} s, {count} joints of a body", places.len(), frame_time);
    Ok(DrawnMotion { body, chosen, facts: RigFacts::of(&rig, loaded.format) })
}

/// The joints that are looked at, by their names, the pelvis first.
fn joints(rig: &Rig<'_>, which: Joints) -> Vec<(String, usize)> {
    let of_body = body_joints().into_iter().filter_map(|name| Some((joint_of(rig, &name)?, name)));
    let mut joints: Vec<(String, usize)> = of_body.map(|(joint, name)| (name, joint)).collect();
    if which == Joints::All {
        for (index, joint) in rig.skeleton().joints().iter().enumerate() {
            if !joints.iter().any(|(name, _)| *name == joint.name) {
                joints.push((joint.name.to_string(), index));
            }
        }
    }
    joints
}

/// The joint of a rig that goes by one of the names of [`body_joints`].
fn joint_of(rig: &Rig<'_>, name: &str) -> Option<usize> {
    match name {
        "chest" => rig.role("spine").last().copied(),
        name => rig.role(name).first().copied(),
    }
}

/// The frames of a clip that are taken, and the seconds between them: all where they come evenly and not too often, or as often as was
/// asked for; else the nearest ones.
fn frames(clip: &Clip, as_asked: bool) -> (Vec<usize>, f64) {
    let times = clip.times_seconds();
    let fps = clip.uniform_fps().unwrap_or(MAX_FPS);
    if clip.uniform_fps().is_some() && (as_asked || fps <= MAX_FPS * 1.001) {
        return ((0..times.len()).collect(), 1.0 / fps);
    }
    // A whole share of an even rate takes frames as they are.
    let fps = if clip.uniform_fps().is_some() { fps / (fps / MAX_FPS).round().max(1.0) } else { MAX_FPS };
    let count = (clip.duration_seconds() * fps).floor() as usize + 1;
    let begin = times.first().copied().unwrap_or(0.0);
    let nearest = |index: usize| {
        let time = begin + index as f64 / fps;
        let after = times.partition_point(|other| *other < time).min(times.len() - 1);
        let before = after.saturating_sub(1);
        if time - times[before] <= times[after] - time { before } else { after }
    };
    ((0..count).map(nearest).collect(), 1.0 / fps)
}
