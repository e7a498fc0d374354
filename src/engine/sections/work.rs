//! One section after the other: read, moved, measured, written.

use crate::{
    formats::{self, Budget, ClipTimes, FormatError, Limits, SectionWriter, SectionedFile},
    model::{Clip, Control, Reporter},
    retarget::{Mapping, ReportDetail, RetargetSpec, Stack, StackResult, measure},
    rig::Rig,
};

use super::{
    super::{Failure, FailureCode, Timings, files::Files, output_request::OutputRequest, retarget_run::run_failure},
    found::Found,
    layout::{Layout, Section},
    seam::Tail,
};

/// What all sections are worked through with, and what was found so far.
pub(super) struct Work<'a> {
    pub(super) rigs: (&'a Rig<'a>, &'a Rig<'a>),
    pub(super) spec: &'a RetargetSpec,
    pub(super) mapping: &'a Mapping,
    pub(super) stack: &'a Stack,
    pub(super) bounds: (&'a Limits, &'a Control),
    pub(super) wanted: &'a [OutputRequest],
    pub(super) writers: Vec<SectionWriter<'a>>,
    pub(super) found: Found,
    pub(super) timings: Timings,
}

impl Work<'_> {
    /// Moves one section after the other. `first` is the first one's clip, out of those files.
    pub(super) fn through(
        &mut self,
        source: &mut dyn SectionedFile,
        (layout, times): (&Layout, &ClipTimes),
        (first, files): (&Clip, &Files),
        reporter: &mut Reporter,
    ) -> Result<(), Failure> {
        let mut tail: Option<Tail> = None;
        for (index, section) in layout.sections.iter().enumerate() {
            let reading = self.bounds.1.seconds();
            let read = match index {
                0 => None,
                _ => Some(self.read(source, section, files)?),
            };
            let clip = read.as_ref().unwrap_or(first);
            self.timings.read_seconds += self.bounds.1.seconds() - reading;
            let is_last = index + 1 == layout.sections.len();
            let result = self.section(section, clip, tail.as_ref(), times.seconds(section.read.start))?;
            let own = section.own.start - section.read.start..section.own.end - section.read.start;
            tail = (!is_last).then(|| Tail::new(result.section(own.end..own.end + layout.fade_frames)));
            let writing = self.bounds.1.seconds();
            let own = result.section(own);
            for (writer, wanted) in self.writers.iter_mut().zip(self.wanted) {
                let renamed = wanted.options.clip_name.as_ref().map(|name| own.clone().renamed(name.clone()));
                let clip = renamed.as_ref().unwrap_or(&own);
                writer.add(clip, self.bounds.1, reporter).map_err(|error| Failure::from(error).in_part("target"))?;
            }
            self.timings.write_seconds += self.bounds.1.seconds() - writing;
        }
        Ok(())
    }

    /// Moves and measures one section.
    fn section(
        &mut self,
        section: &Section,
        clip: &Clip,
        tail: Option<&Tail>,
        begins_seconds: f64,
    ) -> Result<Clip, Failure> {
        let control = self.bounds.1;
        let moving = control.seconds();
        let StackResult { clip: result, reaches, limited, .. } = self.stack.run(clip, control).map_err(run_failure)?;
        let first = section.own.start - section.read.start;
        let result = match tail {
            Some(tail) => tail.fade_into(result, first).map_err(|error| run_failure(error.into()))?,
            None => result,
        };
        self.timings.retarget_seconds += control.seconds() - moving;
        control.check()?;
        let measuring = control.seconds();
        let measures = (self.spec.report.detail() != ReportDetail::None).then(|| {
            let (source, target) = self.rigs;
            measure(self.mapping, source, target, clip, &result, &self.spec.report, &reaches)
        });
        self.found.add(section, begins_seconds, measures, (reaches, limited));
        self.timings.measure_seconds += control.seconds() - measuring;
        Ok(result)
    }

    /// The clip of a section that is not the first one.
    fn read(&self, source: &mut dyn SectionedFile, section: &Section, files: &Files) -> Result<Clip, Failure> {
        let (limits, control) = self.bounds;
        let of_source = |error: FormatError| Failure::from(error).in_part("source");
        let bytes = source.section(section.read.clone(), control).map_err(of_source)?;
        let mut warnings = Reporter::new();
        let mut budget = Budget::new(limits, control);
        let format = files.source.format;
        let mut scene = formats::read_within(&bytes, format, &mut budget, &mut warnings).map_err(of_source)?;
        // A file that is understood in another way here than at its beginning would move another figure.
        let code = "positions_from_offsets";
        let is_told = |reporter: &Reporter| reporter.warnings().iter().any(|warning| warning.code == code);
        let is_like_first =
            scene.skeleton == files.source.scene.skeleton && is_told(&warnings) == is_told(&files.source.warnings);
        let clip = if scene.clips.is_empty() { None } else { Some(scene.clips.swap_remove(0)) };
        match clip.filter(|clip| is_like_first && clip.frame_count() == section.read.len()) {
            Some(clip) => Ok(clip),
            None => {
                let detail =
                    format!("from frame {} on the file reads as another skeleton than before", section.read.start);
                let failure = Failure::new(FailureCode::AssetMalformed, detail).in_part("source");
                Err(failure.with_hint("cut the clip into shorter ones, each in a file of its own"))
            }
        }
    }
}
