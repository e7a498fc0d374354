//! A file that grows by the frames of one section of a clip after the other.

use std::ops::Range;

use super::{ClipTimes, WriteSeek, unwritable};
use crate::{
    formats::{
        Compression, Format, FormatError, TargetClips, WriteOptions,
        bvh::BvhSectionWriter,
        encode,
        gltf::{FRAMES_OF_DOCUMENT, GlbSectionWriter},
        space,
    },
    model::{Axes, Clip, Control, Reporter, Scene},
};

/// Writes a long clip of a target, section by section.
pub struct SectionWriter<'a> {
    target: &'a Scene,
    /// The axes and the meters of a unit that the target was found to have.
    space: (Axes, f64),
    options: WriteOptions,
    times: ClipTimes,
    sink: &'a mut dyn WriteSeek,
    file: Option<File>,
    /// Frames that are written.
    written: usize,
}

enum File {
    Glb(GlbSectionWriter),
    Bvh(BvhSectionWriter),
}

impl<'a> SectionWriter<'a> {
    /// Nothing where a file of that format, one that is compressed or one of a single frame has to be written as a whole.
    #[must_use]
    pub fn new(
        target: &'a Scene,
        space: (Axes, f64),
        options: WriteOptions,
        times: ClipTimes,
        sink: &'a mut dyn WriteSeek,
    ) -> Option<Self> {
        let is_whole = times.frames() < FRAMES_OF_DOCUMENT || options.compression != Compression::None;
        let can = Self::can_write(options.format) && !is_whole;
        can.then_some(Self { target, space, options, times, sink, file: None, written: 0 })
    }

    /// Whether files of a format can be written in sections.
    #[must_use]
    pub const fn can_write(format: Format) -> bool {
        matches!(format, Format::Glb | Format::Vrm | Format::Bvh)
    }

    /// Adds the frames that follow.
    ///
    /// # Errors
    /// When the clip is not of the target, or animates something that its first section did not; when the file cannot be written, or not
    /// be as large; or when the work is canceled.
    pub fn add(&mut self, clip: &Clip, control: &Control, reporter: &mut Reporter) -> Result<(), FormatError> {
        let frames = self.written..self.written + clip.frame_count();
        // A joint that is still in one section may move in the next.
        let clip = clip.clone().sampled();
        match self.options.format {
            Format::Bvh => self.add_rows(&clip, control, reporter)?,
            _ => self.add_arrays(&clip, frames.clone(), control, reporter)?,
        }
        self.written = frames.end;
        Ok(())
    }

    fn add_arrays(
        &mut self,
        clip: &Clip,
        frames: Range<usize>,
        control: &Control,
        reporter: &mut Reporter,
    ) -> Result<(), FormatError> {
        let write = |clip: &Clip, options: &WriteOptions, reporter: &mut Reporter| {
            let converted = space::converted(self.target, clip, self.space, options)?;
            let (target, clip) = converted.as_ref().map_or((self.target, clip), |(target, clip)| (target, clip));
            encode(target, &[], clip, options, control, reporter)
        };
        let file = match self.file.take() {
            Some(File::Glb(file)) => file,
            _ => {
                let head = clip.section(0..FRAMES_OF_DOCUMENT.min(clip.frame_count()));
                GlbSectionWriter::begin(&write(&head, &self.options, reporter)?, &self.times, self.sink)?
            }
        };
        let values_only = WriteOptions { target_clips: TargetClips::Drop, extras: None, ..self.options.clone() };
        file.add(&write(clip, &values_only, &mut Reporter::new())?, frames, self.sink)?;
        self.file = Some(File::Glb(file));
        Ok(())
    }

    fn add_rows(&mut self, clip: &Clip, control: &Control, reporter: &mut Reporter) -> Result<(), FormatError> {
        let converted = space::converted(self.target, clip, self.space, &self.options)?;
        let of_target = converted.as_ref().map_or((self.target, clip), |(target, clip)| (target, clip));
        let mut file = match self.file.take() {
            Some(File::Bvh(file)) => file,
            _ => BvhSectionWriter::begin(
                of_target,
                &self.times,
                self.options.rotation_order,
                self.sink,
                control,
                reporter,
            )?,
        };
        file.add(of_target, self.sink, control)?;
        self.file = Some(File::Bvh(file));
        Ok(())
    }

    /// Ends the file.
    ///
    /// # Errors
    /// When frames are missing, or the file cannot be written.
    pub fn finish(self) -> Result<(), FormatError> {
        let frames = self.times.frames();
        if self.written != frames {
            let detail = format!("{} of {frames} frames were written", self.written);
            return Err(FormatError::malformed("write", "", detail).with_hint("this is a bug; please report it"));
        }
        self.sink.flush().map_err(unwritable)
    }
}
