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
}

impl Clock {
    /// The clip as it is.
    pub(in crate::retarget) const fn of_clip(frames: usize) -> Self {
        Self { own: 0..frames, shown: Vec::new(), period: None }
    }

    /// A clip that begins again after `period` frames. `shown` has one entry per frame: which one of the clip it shows. Of `own` these are all in
    /// turn.
    pub(in crate::retarget) const fn repeated(own: Range<usize>, shown: Vec<usize>, period: usize) -> Self {
        Self { own, shown, period: Some(period) }
    }

    /// After how many frames the clip begins again; nothing where it does not.
    pub(in crate::retarget) const fn period(&self) -> Option<usize> {
        self.period
    }

    /// The frames that are the clip.
    pub(in crate::retarget) fn own(&self) -> Range<usize> {
        self.own.clone()
    }

    /// The frame of the clip that is shown.
    pub(in crate::retarget) fn clip_frame(&self, frame: usize) -> usize {
        self.shown.get(frame).copied().unwrap_or(frame)
    }
}

/// A frame of the clip, and when it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::retarget) struct Moment {
    pub(in crate::retarget) frame: usize,
    /// On the clip's own clock.
    pub(in crate::retarget) seconds: f64,
}
