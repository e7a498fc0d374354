//! How a long clip is divided.

use std::ops::Range;

use super::SectionsView;
use crate::formats::ClipTimes;

/// Frames of a section at most, without those around it. With 65 joints a copy of their rotations takes four megabytes, and measuring one, in
/// which nobody looks whether the work is canceled, tens of milliseconds.
const MAX_FRAMES: usize = 4096;
/// What is looked at before and behind a section: contacts, the levels at which feet rest and all fades are found within less.
const MARGIN_SECONDS: f64 = 6.0;
/// The same in frames, at most and at least.
const MARGIN_FRAMES: (usize, usize) = (60, 2048);
/// Over which two sections go over into one another.
const FADE_SECONDS: f64 = 0.5;

/// A section of a clip.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Section {
    /// Its frames.
    pub(super) own: Range<usize>,
    /// Those and the ones that are looked at around them.
    pub(super) read: Range<usize>,
}

/// The sections of a clip, in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Layout {
    pub(super) sections: Vec<Section>,
    /// So many frames at the beginning of a section go over from the one before it, which is worked out as far.
    pub(super) fade_frames: usize,
}

impl Layout {
    /// `times` has at least one frame.
    pub(super) fn new(times: &ClipTimes) -> Self {
        let frames = times.frames();
        let duration = times.duration_seconds().max(f64::MIN_POSITIVE);
        let frames_in = |seconds: f64| (seconds * (frames - 1) as f64 / duration).ceil() as usize;
        let margin = frames_in(MARGIN_SECONDS).clamp(MARGIN_FRAMES.0, MARGIN_FRAMES.1);
        let count = frames.div_ceil(MAX_FRAMES);
        let border = |index: usize| frames * index / count;
        let section = |index: usize| {
            let own = border(index)..border(index + 1);
            Section { read: own.start.saturating_sub(margin)..(own.end + margin).min(frames), own }
        };
        Self {
            sections: (0..count).map(section).collect(),
            fade_frames: frames_in(FADE_SECONDS).clamp(2, margin / 2).min(border(1)),
        }
    }

    /// What the report says of it.
    pub(super) fn view(&self) -> SectionsView {
        let Self { sections, fade_frames } = self;
        SectionsView {
            count: sections.len(),
            frames: sections.iter().map(|section| section.own.len()).max().unwrap_or(0),
            fade_frames: if sections.len() > 1 { *fade_frames } else { 0 },
        }
    }

    /// Frames that are worked on, those around sections counted each time.
    pub(super) fn work(&self) -> u64 {
        self.sections.iter().map(|section| section.read.len() as u64).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_cover_every_frame_once_and_see_around_themselves() {
        for (frames, step_seconds) in [(1, 0.1), (2, 0.01), (4096, 1.0 / 30.0), (4097, 1.0 / 30.0), (100_001, 1e-3)] {
            let times = ClipTimes::Even { first_seconds: 0.0, step_seconds, frames };
            let Layout { sections, fade_frames } = Layout::new(&times);
            let mut at = 0;
            for Section { own, read } in &sections {
                assert_eq!(own.start, at, "no gap in {frames}");
                assert!(own.len() <= MAX_FRAMES && !own.is_empty(), "{own:?} of {frames}");
                assert!(read.start <= own.start && own.end <= read.end && read.end <= frames, "{read:?} of {frames}");
                at = own.end;
            }
            assert_eq!(at, frames, "all of them");
            let fades = sections.iter().skip(1).zip(&sections);
            for (next, section) in fades {
                assert!(section.read.end >= next.own.start + fade_frames, "worked out far enough");
                assert!(fade_frames <= next.own.len(), "within the section");
            }
        }
    }
}
