//! What is found out section by section, put together.

use crate::retarget::{LimbReach, LimitedJoint, Measures, add_limited, add_reaches};

use super::layout::Section;

/// What was found so far.
#[derive(Default)]
pub(super) struct Found {
    pub(super) measures: Option<Measures>,
    pub(super) reaches: Vec<LimbReach>,
    pub(super) limited: Vec<LimitedJoint>,
    /// Frames that were worked on.
    frames: usize,
    /// Frames of the clip so far.
    clip_frames: usize,
}

impl Found {
    /// Adds what was found of a section and of what lies around it, which begins so late in the clip.
    pub(super) fn add(
        &mut self,
        section: &Section,
        begins_seconds: f64,
        measures: Option<Measures>,
        (reaches, limited): (Vec<LimbReach>, Vec<LimitedJoint>),
    ) {
        let (first, frames) = (section.read.start, section.read.len());
        self.clip_frames = section.own.end;
        self.measures = match (self.measures.take(), measures.map(|measures| measures.shifted(first, begins_seconds))) {
            (Some(before), Some(measures)) => Some(before.with_section(measures)),
            (before, measures) => before.or(measures),
        };
        if let Some(measures) = &mut self.measures {
            // Those around sections are looked at twice.
            measures.frames_measured = measures.frames_measured.min(self.clip_frames);
            measures.curves.clear();
        }
        add_reaches(&mut self.reaches, reaches, first, [self.frames, frames]);
        add_limited(&mut self.limited, limited, first);
        self.frames += frames;
    }
}
