//! What lies about a range while a filter looks at it.

use crate::{
    model::{Clip, Control, Skeleton},
    retarget::{EditSpec, MirrorPlane, RangeSpec},
};

use super::{
    error::EditError,
    time::{TimeEditError, in_range, seconds_of},
};

/// The longest margin, in seconds.
const MAX_SECONDS: f64 = 60.0;

/// Two edits in place of one: what is done first, on a range that is wider, and what is cut out of that at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Margin {
    /// The edit with the wider range. Its frames lie where those of the edit itself do, and more before and after.
    pub wider: EditSpec,
    /// The range that was asked for, on the clock of the result.
    pub cut: EditSpec,
}

impl Margin {
    /// The margin that an edit asks for, as far as the clip has one; nothing where it asks for none.
    ///
    /// # Errors
    /// When there is no range or no filter for it, or another edit leaves no clip before and after the range.
    pub fn of(
        spec: &EditSpec,
        clip: &Clip,
        skeleton: &Skeleton,
        control: &Control,
    ) -> Result<Option<Self>, TimeEditError> {
        let asked = in_range("margin_seconds", spec.margin_seconds, 0.0, MAX_SECONDS)?;
        if asked == 0.0 {
            return Ok(None);
        }
        if let Some(detail) = in_the_way(spec) {
            let hint = "leave margin_seconds out";
            return Err(EditError::new("margin_seconds", detail, hint).into());
        }
        let Some(range) = &spec.range else { return Ok(None) };
        let (start, end) = seconds_of(range, clip, skeleton, control)?;
        let speed = in_range("speed", spec.speed.unwrap_or(1.0), 0.001, 1000.0)?;
        let times = clip.times_seconds();
        let before = whole_frames(asked.min(start - times[0]), speed, spec.fps);
        let after = whole_frames(asked.min(times[times.len() - 1] - end), speed, spec.fps);
        let lead = if spec.reverse { after } else { before } / speed;
        let duration = (end - start) / speed;
        let duration = spec.fps.map_or(duration, |fps| (duration * fps).round() / fps);
        let begin = spec.start_seconds.unwrap_or(0.0);
        let wider = EditSpec {
            range: Some(RangeSpec::Seconds([start - before, end + after])),
            start_seconds: Some(begin - lead),
            margin_seconds: 0.0,
            ..spec.clone()
        };
        let cut = EditSpec {
            range: Some(RangeSpec::Seconds([begin, begin + duration])),
            start_seconds: Some(begin),
            interpolation: spec.interpolation,
            ..EditSpec::default()
        };
        Ok(Some(Self { wider, cut }))
    }
}

/// So many whole frames of the result that the frames of the range stay where they are, in seconds of the clip.
fn whole_frames(seconds: f64, speed: f64, fps: Option<f64>) -> f64 {
    // A rounding error is no reason to leave out a frame.
    fps.filter(|fps| *fps > 0.0).map_or(seconds, |fps| (seconds / speed * fps + 1e-6).floor() / fps * speed)
}

/// Why an edit can have no margin.
fn in_the_way(spec: &EditSpec) -> Option<String> {
    if spec.range.is_none() {
        return Some("a margin is what lies about a range, and this edit has no 'range'".to_owned());
    }
    if spec.filter.is_none() {
        return Some("only a filter looks at the margin, and this edit has no 'filter'".to_owned());
    }
    let starts_anew = spec.mirror.details().is_some_and(|mirror| mirror.plane == MirrorPlane::Start);
    let by_frame = spec.filter.as_ref().is_some_and(|filter| filter.scope.frames.is_some());
    let others = [
        ("every", spec.every.is_some()),
        ("warp", spec.warp.is_some()),
        ("ping_pong", spec.ping_pong),
        ("loop", spec.make_loop.is_some()),
        ("hold", spec.hold.is_some()),
        ("mirror.plane: start", starts_anew),
        ("filter.frames", by_frame),
    ];
    let (name, _) = others.into_iter().find(|(_, given)| *given)?;
    Some(format!("'{name}' goes by the ends of the range, so there can be no margin about it"))
}
