//! A clip of any rig as the motion of a body that drives drawings.

use glam::DVec3;

use crate::{
    drawing::{BodyMotion, body_joints},
    formats::Limits,
    model::{Clip, Control, Reporter},
    rig::Rig,
};

use super::{
    Failure, FailureCode, NamedBytes,
    load::load,
    preview::{chosen, rig_of},
};

/// Pictures of drawings that are made for a second of motion, at most.
const MAX_FPS: f64 = 30.0;

/// The motion of a file, by the names of [`body_joints`]; and what was chosen, as a sentence.
///
/// # Errors
/// When the file cannot be read, moves nothing, or shows no body.
pub(super) fn drawn_motion(
    file: NamedBytes<'_>,
    clip: Option<&str>,
    limits: &Limits,
    control: &Control,
) -> Result<(BodyMotion, String), Failure> {
    let mut reporter = Reporter::new();
    let loaded = load(file, "motion", limits, control, &mut reporter)?;
    let clip = chosen(&loaded.scene, clip)?.ok_or_else(|| {
        let failure = Failure::new(FailureCode::NoAnimation, format!("{}: nothing moves in the file", file.name));
        failure.with_hint("give a file with a clip")
    })?;
    let no_body = |detail: String| {
        Failure::new(FailureCode::InvalidValue, format!("{}: {detail}", file.name))
            .with_hint("'retargetd inspect FILE' says what was recognized; a drawing is driven by a body with two arms or two legs")
    };
    let rig = rig_of(&loaded.scene).ok_or_else(|| no_body("the file has no skeleton".to_owned()))?;
    let joints: Vec<(String, usize)> = body_joints()
        .into_iter()
        .filter_map(|name| Some((joint_of(&rig, &name)?, name)))
        .map(|(joint, name)| (name, joint))
        .collect();
    if joints.first().is_none_or(|(name, _)| name != "pelvis") {
        return Err(no_body("no body was recognized".to_owned()));
    }
    let place = |name: &str| joints.iter().position(|(other, _)| other == name);
    let pair = |name: &str| Some((place(&format!("left_{name}"))?, place(&format!("right_{name}"))?));
    let pairs: Vec<(usize, usize)> = ["upper_arm", "thigh"].into_iter().filter_map(pair).collect();
    if pairs.is_empty() {
        return Err(no_body("no pair of arms or legs was recognized".to_owned()));
    }
    let (frames, frame_time) = frames(clip);
    let mut places = Vec::with_capacity(frames.len());
    for frame in frames {
        control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
        let model = clip.local_pose(rig.skeleton(), frame).to_model(rig.skeleton());
        let place = |joint: usize| rig.work_from_scene * model.transforms()[joint].translation * rig.unit_metres;
        places.push(joints.iter().map(|(_, joint)| place(*joint)).collect::<Vec<DVec3>>());
    }
    let names = joints.iter().map(|(name, _)| name.clone()).collect();
    let motion = BodyMotion::of_places(names, frame_time, pairs, &places)
        .map_err(|error| Failure::new(FailureCode::InvalidValue, error.in_file(file.name).to_string()))?;
    let clip_name = if clip.name().is_empty() { "its clip".to_owned() } else { format!("clip '{}'", clip.name()) };
    let chosen =
        format!("{clip_name}, {} frames of {:.4} s, {} joints of a body", places.len(), frame_time, joints.len());
    Ok((motion, chosen))
}

/// The joint of a rig that goes by one of the names of [`body_joints`].
fn joint_of(rig: &Rig<'_>, name: &str) -> Option<usize> {
    match name {
        "chest" => rig.role("spine").last().copied(),
        name => rig.role(name).first().copied(),
    }
}

/// The frames of a clip that are taken, and the seconds between them: all where they come evenly and not too often, else the nearest ones.
fn frames(clip: &Clip) -> (Vec<usize>, f64) {
    let times = clip.times_seconds();
    let fps = clip.uniform_fps().unwrap_or(MAX_FPS);
    if clip.uniform_fps().is_some() && fps <= MAX_FPS * 1.001 {
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
