//! A BVH in sections: its hierarchy with the rows of some frames.

use std::{
    io::{BufRead, BufReader, Read, Seek, SeekFrom},
    ops::Range,
};

use crate::{
    formats::{
        Format, FormatError,
        sections::{ClipTimes, ReadSeek, Sectioned, SectionedFile, unreadable},
    },
    model::Control,
};

/// A hierarchy is looked for in so many bytes; a joint has about a hundred.
const MAX_HEAD_BYTES: u64 = 4 << 20;
/// A row has at most six numbers a joint.
const MAX_ROW_BYTES: u64 = 16 << 20;
/// Rows between two places that are remembered.
const ROWS_BETWEEN_MARKS: usize = 1024;
/// Bytes that are read at once.
const BUFFER_BYTES: usize = 1 << 20;

struct BvhSections {
    reader: BufReader<Box<dyn ReadSeek>>,
    /// Everything before MOTION.
    hierarchy: Vec<u8>,
    times: ClipTimes,
    step_seconds: f64,
    /// Where every 1,024th row begins, as far as the file has been read.
    marks: Vec<u64>,
}

/// Looks at the beginning of a BVH.
pub(in crate::formats) fn open_in_sections(mut reader: Box<dyn ReadSeek>) -> Result<Sectioned, FormatError> {
    let mut head = Vec::new();
    reader.by_ref().take(MAX_HEAD_BYTES).read_to_end(&mut head).map_err(unreadable)?;
    let Some(Head { hierarchy, first_row, frames, step_seconds }) = Head::find(&head) else {
        return Ok(Sectioned::WholeOnly("the file does not say as BVH files do how many frames it has"));
    };
    if frames == 0 {
        return Ok(Sectioned::WholeOnly("the file has no frames"));
    }
    Ok(Sectioned::File(Box::new(BvhSections {
        reader: BufReader::with_capacity(BUFFER_BYTES, reader),
        hierarchy: head[..hierarchy].to_vec(),
        times: ClipTimes::Even { first_seconds: 0.0, step_seconds, frames },
        step_seconds,
        marks: vec![first_row as u64],
    })))
}

/// What stands before the rows.
#[derive(Debug, PartialEq)]
struct Head {
    /// Bytes before MOTION.
    hierarchy: usize,
    /// Where the first row begins.
    first_row: usize,
    frames: usize,
    step_seconds: f64,
}

impl Head {
    /// Looks for MOTION, `Frames:` and `Frame Time:`, each on a line of its own.
    fn find(head: &[u8]) -> Option<Self> {
        let mut at = 0;
        let (mut hierarchy, mut frames, mut step_seconds) = (None, None, None);
        for line in head.split_inclusive(|byte| *byte == b'\n') {
            let text = line.trim_ascii().to_ascii_lowercase();
            if hierarchy.is_none() {
                hierarchy = (text == b"motion").then_some(at);
            } else if let Some(rest) = text.strip_prefix(b"frames:") {
                frames = Some(number(rest)? as usize);
            } else if let Some(rest) = text.strip_prefix(b"frame time:") {
                step_seconds = number(rest).filter(|step| *step > 0.0);
            } else if !text.is_empty() {
                return None;
            }
            at += line.len();
            if let (Some(hierarchy), Some(frames), Some(step_seconds)) = (hierarchy, frames, step_seconds) {
                return Some(Self { hierarchy, first_row: at, frames, step_seconds });
            }
        }
        None
    }
}

fn number(text: &[u8]) -> Option<f64> {
    std::str::from_utf8(text).ok()?.trim().parse::<f64>().ok().filter(|number| number.is_finite() && *number >= 0.0)
}

impl SectionedFile for BvhSections {
    fn format(&self) -> Format {
        Format::Bvh
    }

    fn times(&self) -> &ClipTimes {
        &self.times
    }

    fn section(&mut self, frames: Range<usize>, control: &Control) -> Result<Vec<u8>, FormatError> {
        let mark = (frames.start / ROWS_BETWEEN_MARKS).min(self.marks.len() - 1);
        let mut at = self.marks[mark];
        let mut row = mark * ROWS_BETWEEN_MARKS;
        self.reader.seek(SeekFrom::Start(at)).map_err(unreadable)?;
        let mut out = self.hierarchy.clone();
        let head = format!("MOTION\nFrames: {}\nFrame Time: {}\n", frames.len(), self.step_seconds);
        out.extend_from_slice(head.as_bytes());
        let mut line = Vec::new();
        while row < frames.end {
            if row.is_multiple_of(ROWS_BETWEEN_MARKS) {
                control.check()?;
                if self.marks.len() == row / ROWS_BETWEEN_MARKS {
                    self.marks.push(at);
                }
            }
            line.clear();
            let length = self.reader.by_ref().take(MAX_ROW_BYTES).read_until(b'\n', &mut line).map_err(unreadable)?;
            if length == 0 {
                let detail = format!("the file declares {} frames and has {row} rows", self.times.frames());
                return Err(FormatError::malformed("motion", "MOTION", detail)
                    .with_hint("write the number of rows behind 'Frames:', or export the file again"));
            }
            at += length as u64;
            if line.trim_ascii().is_empty() {
                continue;
            }
            if row >= frames.start {
                out.extend_from_slice(&line);
            }
            row += 1;
        }
        Ok(out)
    }

    fn reader(&mut self) -> &mut dyn ReadSeek {
        &mut self.reader
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    fn text(rows: usize) -> String {
        let rows: String =
            (0..rows).map(|row| format!("{row} 0 0\n{}", if row % 7 == 0 { "\r\n" } else { "" })).collect();
        format!(
            "HIERARCHY\nROOT Hips\n{{\n  OFFSET 0 0 0\n  CHANNELS 3 Xposition Yposition Zposition\n}}\n\
             MOTION\r\nFrames: 5000\r\nFrame Time: 0.025\r\n{rows}"
        )
    }

    fn open(rows: usize) -> Box<dyn SectionedFile> {
        match open_in_sections(Box::new(Cursor::new(text(rows).into_bytes()))).expect("it can be read") {
            Sectioned::File(file) => file,
            Sectioned::WholeOnly(reason) => panic!("{reason}"),
            Sectioned::OtherFormat => panic!("it is a BVH"),
        }
    }

    fn rows(file: &mut dyn SectionedFile, frames: Range<usize>) -> Vec<String> {
        let bytes = file.section(frames, &Control::new()).expect("a section");
        let text = String::from_utf8(bytes).expect("text");
        text.split_once("0.025\n").expect("a head").1.lines().map(|row| row.trim().to_owned()).collect()
    }

    #[test]
    fn sections_have_their_rows_in_any_order() {
        let mut file = open(5000);
        assert_eq!(file.times(), &ClipTimes::Even { first_seconds: 0.0, step_seconds: 0.025, frames: 5000 });
        for frames in [0..3, 4000..4003, 2047..2050, 1..2, 4999..5000] {
            let wanted: Vec<String> = frames.clone().map(|row| format!("{row} 0 0")).collect();
            assert_eq!(rows(&mut *file, frames.clone()), wanted, "{frames:?}");
        }
    }

    #[test]
    fn rows_that_are_not_there_are_told() {
        let error = open(4000).section(3990..4010, &Control::new()).expect_err("they are not there");
        assert!(error.to_string().contains("declares 5000 frames and has 4000 rows"), "{error}");
    }

    #[test]
    fn a_head_that_is_none_is_not_guessed() {
        for head in ["HIERARCHY\nMOTION\n1 2 3\n", "HIERARCHY\nMOTION\nFrames: x\nFrame Time: 1\n", "HIERARCHY\n"] {
            assert_eq!(Head::find(head.as_bytes()), None, "{head}");
        }
    }
}
