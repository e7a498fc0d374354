//! A clip that is too long to be held is worked through in sections, from file to file.

use std::{
    fs::{File, Metadata},
    io::{BufReader, BufWriter},
    path::Path,
    sync::Arc,
};

use crate::{
    engine::{self, Failure, ReadSeek, SectionWriter, Sectioned, SectionedFile, SectionedInputs, WriteSeek},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, say},
    files::is_standard,
    inputs::{InputFiles, OntoPaths},
    outputs::{OutputArguments, WantedFormats},
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// What a frame takes at least: a letter and the end of a line in a BVH, a key time of four bytes in a GLB.
const LEAST_BYTES_OF_FRAME: u64 = 2;
/// What is written at once. A section writes a run of this length for each channel of a joint.
const BUFFER_BYTES: usize = 1 << 18;

/// A source that is worked through in sections.
pub(super) struct LongClip {
    file: Box<dyn SectionedFile>,
    is_asked_for: bool,
}

impl LongClip {
    /// The source as one, where that was asked for, or where the file or its clip is longer than is held: more than the limits allow, and
    /// more than they allow by default. A lower limit is meant to refuse.
    ///
    /// # Errors
    /// When sections were asked for and the file cannot be read in some.
    pub(super) fn open(source: &Path, limits: &Limits, is_asked_for: bool) -> Result<Option<Self>, Exit> {
        if is_standard(source) {
            return if is_asked_for { Err(unfit("standard input is read as a whole", source)) } else { Ok(None) };
        }
        // Whoever reads it as a whole says better what is wrong with it.
        let Ok(file) = File::open(source) else { return Ok(None) };
        let Some(length) = file.metadata().ok().filter(Metadata::is_file).map(|metadata| metadata.len()) else {
            return Ok(None);
        };
        let default = Limits::default();
        let most_frames = limits.frames_per_clip.max(default.frames_per_clip);
        let is_large = length > limits.file_bytes.max(default.file_bytes);
        if !is_asked_for && !is_large && length / LEAST_BYTES_OF_FRAME < most_frames {
            return Ok(None);
        }
        let reader: Box<dyn ReadSeek> = Box::new(BufReader::new(file));
        let file = match engine::open_in_sections(reader, limits, &Control::new()) {
            Ok(Sectioned::File(file)) => file,
            Ok(Sectioned::WholeOnly(_)) if !is_asked_for && !is_large => return Ok(None),
            Ok(Sectioned::OtherFormat) if !is_asked_for => return Ok(None),
            Ok(Sectioned::OtherFormat) => return Err(unfit("only GLB and BVH files are read in sections", source)),
            Ok(Sectioned::WholeOnly(reason)) => return otherwise(reason, source, is_asked_for),
            Err(error) if is_asked_for => {
                let subject = format!("source {}", source.display());
                return Err(Exit::from_failure(&Failure::from(error).in_part("source"), &subject));
            }
            Err(_) => return Ok(None),
        };
        let is_long = is_large || file.times().frames() as u64 > most_frames;
        Ok((is_asked_for || is_long).then_some(Self { file, is_asked_for }))
    }

    /// Nothing where the config or the formats that are asked for need the whole clip.
    ///
    /// # Errors
    /// When sections were asked for, or the config is none.
    pub(super) fn with(self, files: &InputFiles, formats: &WantedFormats, source: &Path) -> Result<Option<Self>, Exit> {
        let about_whole = engine::about_whole_clip(files.inputs(&[]).config).map_err(|failure| files.exit(&failure))?;
        let unwritten = formats.of_each.iter().find(|format| !SectionWriter::can_write(**format));
        let reason = match (about_whole, unwritten) {
            (Some(pointer), _) => format!("{pointer} of the config is about the whole clip"),
            (None, Some(format)) => format!("a {} is written as a whole", format.info().name),
            (None, None) => return Ok(Some(self)),
        };
        otherwise(&reason, source, self.is_asked_for)
    }

    /// Works through it.
    pub(super) fn retarget(
        mut self,
        files: &InputFiles,
        onto: &OntoPaths,
        (outputs, formats): (&OutputArguments, &WantedFormats),
        limits: &Limits,
    ) -> Result<(), Exit> {
        let knowledge = onto.knowledge(limits)?;
        let (staged, places) = outputs.stage()?;
        let mut sinks: Vec<BufWriter<File>> =
            places.into_iter().map(|file| BufWriter::with_capacity(BUFFER_BYTES, file)).collect();
        let control = Arc::new(Control::with_clock(crate::telemetry::monotonic_seconds));
        cancel_on_interrupt(&control);
        let watch = ProgressWatch::start(&control, outputs.destinations.progress);
        let to = sinks.iter_mut().map(|sink| sink as &mut dyn WriteSeek);
        let inputs = SectionedInputs {
            source: &mut *self.file,
            others: files.inputs(&[]),
            sinks: formats.of_each.iter().copied().zip(to).collect(),
        };
        let result = engine::retarget_in_sections(inputs, &knowledge, limits, &control);
        drop(watch);
        let outcome = result.map_err(|failure| files.exit(&failure))?;
        outputs.sync(sinks)?;
        outputs.finish_staged(staged, &outcome, &control)?;
        let (counts, seconds) = (&outcome.report.counts, outcome.report.timings.total_seconds);
        let sections = outcome.report.sections.map_or(1, |sections| sections.count);
        let joints = format!("{} of {} target joints driven", counts.driven_joints, counts.target_joints);
        outputs.judge(&outcome, &format!("{} frames in {sections} sections, {joints}, {seconds:.2} s", counts.frames))
    }
}

/// A file that has to be held after all; where sections were asked for, that is an error.
fn otherwise(reason: &str, source: &Path, is_asked_for: bool) -> Result<Option<LongClip>, Exit> {
    if is_asked_for {
        return Err(unfit(reason, source));
    }
    say(format_args!("note: source {}: the long clip is held as a whole, since {reason}", source.display()));
    Ok(None)
}

fn unfit(reason: &str, source: &Path) -> Exit {
    let message = format!("source {}: it cannot be worked through in sections: {reason}", source.display());
    Exit::new(BAD_USAGE, message, "leave out --sections")
}
