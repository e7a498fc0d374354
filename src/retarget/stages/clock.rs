//! Which frames of the clip the frames are that stages work on.

use std::ops::Range;

/// A clip that flows into itself is worked on with what is played before it and after it.
#[derive(Clone, Debug)]
pub(in crate::retarget) struct Clock {
    /// The frames that are the clip.
    own: Range<usize>,
    /// Which frame of the clip each one shows; empty where all are the clip.
    shown: Vec<usize>,
    /// After so many frames the clip begins again; nothing where it does not.
    period: Option<usize>,
    /// How many frames of a longer clip are before this one, which is a part of it.
    before: usize,
}

impl Clock {
    /// The clip as it is.
    pub(in crate::retarget) const fn of_clip(frames: usize) -> Self {
        Self { own: 0..frames, shown: Vec::new(), period: None, before: 0 }
    }

    /// A part of a clip.
    pub(in crate::retarget) const fn of_part(frames: &Range<usize>) -> Self {
        Self { own: 0..frames.end - frames.start, shown: Vec::new(), period: None, before: frames.start }
    }

    /// A clip that begins again after `period` frames. `shown` has one entry per frame: which one of the clip it shows. Of `own` these are all in
    /// turn.
    pub(in crate::retarget) const fn repeated(own: Range<usize>, shown: Vec<usize>, period: usize) -> Self {
        Self { own, shown, period: Some(period), before: 0 }
    }

    /// After how many frames the clip begins again; nothing where it does not.
    pub(in crate::retarget) const fn period(&self) -> Option<usize> {
        self.period
    }

    /// The frames that are the clip.
    pub(in crate::retarget) fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// The frame of the clip that is shown, and which of the frames that are the clip that is.
    pub(in crate::retarget) fn clip_frame(&self, frame: usize) -> (usize, usize) {
        let own = self.shown.get(frame).copied().unwrap_or(frame);
        (self.before + own, self.own.start + own)
    }
}

/// A frame of the clip, and when it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::retarget) struct Moment {
    pub(in crate::retarget) frame: usize,
    /// On the clip's own clock.
    pub(in crate::retarget) seconds: f64,
}
