//! Long clips, a section at a time: so much of a file as holds some frames, as a file of its own that the readers of its format take; and
//! a file that grows by the frames of one clip after the other.
//!
//! What is in memory are a section and the times of all frames, however long the clip is.

mod times;
mod writer;

use std::{
    io::{Read, Seek, Write},
    ops::Range,
};

use super::{Format, FormatError, Limits, bvh, gltf};
use crate::model::Control;

pub use times::ClipTimes;
pub use writer::SectionWriter;

/// What a format is recognized by.
const HEAD_BYTES: u64 = 256;
const BVH_WORD: &[u8] = b"HIERARCHY";

/// What a long file is read from.
pub trait ReadSeek: Read + Seek {}

impl<T: Read + Seek> ReadSeek for T {}

/// What a long file is written to.
pub trait WriteSeek: Write + Seek {}

impl<T: Write + Seek> WriteSeek for T {}

/// A file whose clip is read in sections.
pub trait SectionedFile {
    /// The file's format, which is that of its sections too.
    fn format(&self) -> Format;

    /// When its frames are.
    fn times(&self) -> &ClipTimes;

    /// Whether the file says when joints touch something, which its sections do not hold.
    fn has_contacts(&self) -> bool {
        false
    }

    /// A file with these frames alone, which begins at time 0, and with everything else of the whole file.
    ///
    /// # Errors
    /// When the file cannot be read, or does not hold the frames; or when the work is canceled.
    fn section(&mut self, frames: Range<usize>, control: &Control) -> Result<Vec<u8>, FormatError>;

    /// What the file is read from, to go through all of its bytes.
    fn reader(&mut self) -> &mut dyn ReadSeek;
}

/// A file that may be read in sections.
pub enum Sectioned {
    /// It can.
    File(Box<dyn SectionedFile>),
    /// It can be read only as a whole, and why.
    WholeOnly(&'static str),
    /// It is of another format.
    OtherFormat,
}

/// Looks at the beginning of a file, a glTF in its binary form or a BVH.
///
/// # Errors
/// When the file cannot be read, or what says how its clip lies in it breaks the rules of its format.
pub fn open_in_sections(
    mut reader: Box<dyn ReadSeek>,
    limits: &Limits,
    control: &Control,
) -> Result<Sectioned, FormatError> {
    let mut head = Vec::new();
    reader.by_ref().take(HEAD_BYTES).read_to_end(&mut head).map_err(unreadable)?;
    reader.rewind().map_err(unreadable)?;
    if head.starts_with(&gltf::MAGIC) {
        return gltf::open_in_sections(reader, limits, control);
    }
    let text = head.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&head).trim_ascii_start();
    if text.get(..BVH_WORD.len()).is_some_and(|word| word.eq_ignore_ascii_case(BVH_WORD)) {
        return bvh::open_in_sections(reader);
    }
    Ok(Sectioned::OtherFormat)
}

pub(super) fn unreadable(error: std::io::Error) -> FormatError {
    FormatError::malformed("file", "", format!("the file cannot be read: {error}"))
        .with_hint("check the disk or the network that it is on")
}

pub(super) fn unwritable(error: std::io::Error) -> FormatError {
    FormatError::malformed("write", "", format!("the file cannot be written: {error}"))
        .with_hint("check that the disk has room for it")
}
