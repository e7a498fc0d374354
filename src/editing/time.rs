//! All edits of time, in their order.

use glam::DVec3;

use crate::{
    model::{Canceled, Clip, Control, Skeleton},
    retarget::{CycleRange, EditSpec, InterpolationSpec, RangeSpec},
};

use super::{
    cycle::find_cycles, error::EditError, looping::make_loop, sampling::Sampling, schedule::Schedule, warp::Warp,
};

/// An edited clip has at most so many frames: a day at 60 fps is five million.
const MAX_FRAMES: usize = 10_000_000;
/// Frames times animated joints; each takes up to 40 bytes.
const MAX_VALUES: usize = 400_000_000;

/// Why there is no edited clip.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TimeEditError {
    /// What was asked for cannot be done.
    #[error(transparent)]
    Edit(#[from] EditError),
    /// Nobody wants it any longer.
    #[error(transparent)]
    Canceled(#[from] Canceled),
}

/// Does every edit of time that the spec asks for; `mirror` is left to [`super::Mirror`].
///
/// Gives the clip itself where the spec asks for none. Frames that show a key keep its values to the bit. `up` is the vertical in
/// model space, for loops that travel.
///
/// # Errors
/// When a range is empty or outside the clip, times do not rise, or the result would have too many frames; when the work is canceled.
pub fn edit_time(
    clip: &Clip,
    skeleton: &Skeleton,
    up: DVec3,
    spec: &EditSpec,
    control: &Control,
) -> Result<Clip, TimeEditError> {
    edit_time_by(clip, &|_| Ok(None), skeleton, up, spec, control)
}

/// What a clip is at rising times between its keys, where more is known of it than its keys; a frame for each time.
pub type BetweenKeys<'a> = dyn Fn(&[f64]) -> Result<Option<Clip>, TimeEditError> + 'a;

/// As [`edit_time`], for a clip of whose curves more is known than its keys.
///
/// # Errors
/// As [`edit_time`].
pub fn edit_time_by(
    clip: &Clip,
    between_keys: &BetweenKeys<'_>,
    skeleton: &Skeleton,
    up: DVec3,
    spec: &EditSpec,
    control: &Control,
) -> Result<Clip, TimeEditError> {
    if spec.keeps_time() {
        return Ok(clip.clone());
    }
    let own = clip;
    let sample = |clip: &Clip, schedule: &Schedule, fps| {
        let cubic = spec.interpolation == InterpolationSpec::Cubic;
        let sampling = Sampling::new(clip.times_seconds(), schedule, fps, cubic);
        let between = if std::ptr::eq(clip, own) { between_keys(&sampling.times_between())? } else { None };
        sampled(clip, schedule, &sampling.knowing(between), spec.start_seconds, control)
    };
    let mut schedule = Schedule::new(clip.times_seconds());
    if let Some(range) = &spec.range {
        let (start, end) = seconds_of(range, clip, skeleton, control)?;
        schedule.crop(start, end);
    }
    let mut thinned = None;
    if let Some(step) = spec.every {
        schedule.every(in_range("every", f64::from(step), 1.0, 10_000.0).map(|_| step as usize)?);
        // New frames between those that are kept must not show those that were dropped.
        if spec.fps.is_some() {
            let kept = sample(clip, &schedule, None)?;
            schedule = Schedule::new(kept.times_seconds());
            thinned = Some(kept);
        }
    }
    let clip = thinned.as_ref().unwrap_or(clip);
    if let Some(points) = &spec.warp {
        let warp = Warp::new(points).ok_or_else(|| {
            let detail = "the warp needs at least one pair of times, and both times must rise from pair to pair";
            EditError::new("warp", detail, "write pairs such as [[0, 0], [1, 1.5]]: clip seconds, new seconds")
        })?;
        schedule.retime(|time| warp.at(time));
    }
    if let Some(speed) = spec.speed {
        let speed = in_range("speed", speed, 0.001, 1000.0)?;
        schedule.retime(|time| time / speed);
    }
    if spec.reverse {
        schedule.reverse();
    }
    if spec.ping_pong {
        check_size(schedule.len() as f64 * 2.0, clip, "ping_pong")?;
        schedule.ping_pong();
    }
    let mut looped = None;
    if let Some(rule) = &spec.make_loop {
        in_range("loop/times", f64::from(rule.times), 1.0, 1000.0)?;
        in_range("loop/blend_seconds", rule.blend_seconds, 0.0, 1e6)?;
        check_size(schedule.len() as f64 * f64::from(rule.times), clip, "loop/times")?;
        let once = sample(clip, &schedule, None)?;
        let repeated = make_loop(&once, skeleton, up, rule)?;
        schedule = Schedule::new(repeated.times_seconds());
        looped = Some(repeated);
    }
    let clip = looped.as_ref().unwrap_or(clip);
    if let Some(hold) = spec.hold {
        let before = in_range("hold/before_seconds", hold.before_seconds, 0.0, 1e5)?;
        schedule.hold(before, in_range("hold/after_seconds", hold.after_seconds, 0.0, 1e5)?);
    }
    if let Some(fps) = spec.fps {
        let fps = in_range("fps", fps, 0.01, 1000.0)?;
        check_size(schedule.frames_at(fps), clip, "fps")?;
        schedule.resample(fps);
    }
    if let Some(start) = spec.start_seconds {
        in_range("start_seconds", start, -1e6, 1e6)?;
    }
    let edited = sample(clip, &schedule, spec.fps)?;
    Ok(edited.with_tempo(own.tempo() * spec.speed.unwrap_or(1.0)))
}

/// The clip at the moments of a schedule.
fn sampled(
    clip: &Clip,
    schedule: &Schedule,
    sampling: &Sampling,
    start_seconds: Option<f64>,
    control: &Control,
) -> Result<Clip, TimeEditError> {
    let mut joints = Vec::with_capacity(clip.joints().len());
    for (joint, tracks) in clip.joints().iter().enumerate() {
        control.check()?;
        joints.push(sampling.joint(joint, tracks));
    }
    let start = start_seconds.unwrap_or(0.0);
    let times = schedule.moments().iter().map(|moment| moment.at + start).collect();
    let edited = Clip::new(clip.name().to_owned(), times, joints);
    let edited = edited.and_then(|edited| edited.with_morphs(sampling.morphs(clip.morphs())));
    let edited = edited.and_then(|edited| edited.with_contacts(sampling.contacts(clip.contacts())));
    Ok(edited.map_err(EditError::from)?)
}

pub(super) fn in_range(field: &str, value: f64, least: f64, most: f64) -> Result<f64, EditError> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    let detail = format!("'{field}' is {value}, and must be from {least} to {most}");
    Err(EditError::new(field, detail, "take a value in that range"))
}

fn check_size(frames: f64, clip: &Clip, field: &str) -> Result<(), EditError> {
    let joints = clip.joints().iter().filter(|joint| joint.rotation.is_animated() || joint.translation.is_animated());
    let most = (MAX_VALUES / joints.count().max(1)).min(MAX_FRAMES);
    if frames <= most as f64 {
        return Ok(());
    }
    let detail = format!("the edited clip would have {frames} frames, and at most {most} are allowed");
    Err(EditError::new(field, detail, "take a lower rate, fewer repetitions or a shorter range"))
}

/// Start and end on the clip's own clock.
pub(super) fn seconds_of(
    range: &RangeSpec,
    clip: &Clip,
    skeleton: &Skeleton,
    control: &Control,
) -> Result<(f64, f64), TimeEditError> {
    let times = clip.times_seconds();
    let (first, last) = (times[0], times[times.len() - 1]);
    let (start, end) = match range {
        RangeSpec::Seconds([start, end]) => (*start, *end),
        RangeSpec::Frames(range) => {
            let [start, end] = range.frames;
            if end >= times.len() {
                let detail =
                    format!("frame {end} is past the end: the clip's {} frames are counted from 0", times.len());
                let hint = format!("the last frame is {}", times.len() - 1);
                return Err(EditError::new("range/frames/1", detail, hint).into());
            }
            (times[start.min(times.len() - 1)], if start <= end { times[end] } else { f64::NEG_INFINITY })
        }
        RangeSpec::Fraction(range) => {
            let [start, end] = range.fraction;
            in_range("range/fraction/0", start, 0.0, 1.0)?;
            in_range("range/fraction/1", end, 0.0, 1.0)?;
            (first + (last - first) * start, first + (last - first) * end)
        }
        RangeSpec::Cycles(CycleRange { cycles }) => {
            in_range("range/cycles", f64::from(*cycles), 1.0, 1000.0)?;
            let found = find_cycles(clip, skeleton, *cycles, control)?;
            let [start, end] = found.map(|cycle| cycle.seconds).ok_or_else(|| {
                let detail = format!("the poses of the clip do not come back {cycles} times");
                EditError::new("range/cycles", detail, "ask for fewer cycles, or give the range in seconds")
            })?;
            (start, end)
        }
    };
    if !start.is_finite() || end.is_nan() || start > end {
        let hint = "write its start first, then its end";
        return Err(EditError::new("range", "the range ends before it starts", hint).into());
    }
    if start > last || end < first {
        let detail =
            format!("the range from {start} to {end} s is outside the clip, which runs from {first} to {last} s");
        return Err(EditError::new("range", detail, "times are those of the file's keys, in seconds").into());
    }
    Ok((start.max(first), end.min(last)))
}
