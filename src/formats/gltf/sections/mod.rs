//! A GLB in sections: its document with the keys of some frames, in place of those of all.
//!
//! Only what the one animation of the file uses is cut: every sampler is given accessors and views of its own, behind what the rest of
//! the document uses, which stays as it is.

mod samples;
mod views;

use std::{
    io::{Read, SeekFrom},
    ops::Range,
};

use serde_json::{Value, json};

use super::{
    container::{CHUNK_HEADER_BYTES, HEADER_BYTES},
    json,
    write::contain,
};
use crate::{
    formats::{
        Budget, Format, FormatError, Limit, Limits,
        sections::{ClipTimes, ReadSeek, Sectioned, SectionedFile, unreadable},
    },
    model::Control,
};
use samples::{Samples, common_times, is_still, read_elements, samplers};
use views::{kept_views, move_views};

/// Where every piece of the binary chunk begins.
const ALIGNMENT: u64 = 4;

/// Why a file is read as a whole.
type WholeOnly = &'static str;

struct GlbSections {
    reader: Box<dyn ReadSeek>,
    format: Format,
    /// Where the content of the binary chunk begins.
    binary_offset: u64,
    /// The document without what its animation uses.
    document: Value,
    /// Where in the binary chunk is what the document uses beside its animation.
    pieces: Vec<Range<u64>>,
    /// That, once it is read.
    kept: Option<Vec<u8>>,
    limits: Limits,
    times: ClipTimes,
    samplers: Vec<Samples>,
    has_contacts: bool,
}

/// Looks at the beginning of a GLB.
pub(in crate::formats) fn open_in_sections(
    mut reader: Box<dyn ReadSeek>,
    limits: &Limits,
    control: &Control,
) -> Result<Sectioned, FormatError> {
    let mut budget = Budget::new(limits, control);
    let mut header = [0; HEADER_BYTES + CHUNK_HEADER_BYTES];
    reader.read_exact(&mut header).map_err(unreadable)?;
    let json_bytes = u64::from(word(&header, HEADER_BYTES));
    budget.take(Limit::FileBytes, json_bytes, "JSON")?;
    let text = read_bytes(&mut *reader, header.len() as u64, json_bytes)?;
    let document = json::parse(&text, &mut budget)?;
    let Ok(binary_header) = read_bytes(&mut *reader, header.len() as u64 + json_bytes, CHUNK_HEADER_BYTES as u64)
    else {
        return Ok(Sectioned::WholeOnly("the GLB has no binary chunk"));
    };
    let binary_offset = (header.len() + CHUNK_HEADER_BYTES) as u64 + json_bytes;
    let binary_bytes = u64::from(word(&binary_header, 0));
    match GlbSections::new(reader, document, (binary_offset, binary_bytes), &mut budget)? {
        Ok(file) => Ok(Sectioned::File(Box::new(file))),
        Err(reason) => Ok(Sectioned::WholeOnly(reason)),
    }
}

impl GlbSections {
    fn new(
        mut reader: Box<dyn ReadSeek>,
        mut document: Value,
        (binary_offset, binary_bytes): (u64, u64),
        budget: &mut Budget<'_>,
    ) -> Result<Result<Self, WholeOnly>, FormatError> {
        let (inputs, samplers) = match samplers(&document, binary_bytes) {
            Ok(found) => found,
            Err(reason) => return Ok(Err(reason)),
        };
        let Some(times) = common_times(&mut *reader, binary_offset, &inputs, budget)? else {
            return Ok(Err(
                "keys of the clip are at times that differ by joint, that do not rise or that are before zero",
            ));
        };
        for sampler in samplers.iter().filter(|sampler| sampler.is_constant) {
            if !is_still(&mut *reader, binary_offset, sampler)? {
                return Ok(Err("the joints of the clip have keys at times that differ"));
            }
        }
        let kept = kept_views(&document);
        let pieces = match move_views(&mut document, &kept, binary_bytes) {
            Ok(pieces) => pieces,
            Err(reason) => return Ok(Err(reason)),
        };
        let contacts = document
            .pointer_mut("/asset/extras/retargetd")
            .and_then(Value::as_object_mut)
            .and_then(|noted| noted.shift_remove("contacts"));
        let is_vrm = ["/extensions/VRM", "/extensions/VRMC_vrm"].iter().any(|at| document.pointer(at).is_some());
        let format = if is_vrm { Format::Vrm } else { Format::Glb };
        let has_contacts = contacts.is_some();
        let limits = *budget.limits();
        let kept = None;
        Ok(Ok(Self { reader, format, binary_offset, document, pieces, kept, limits, times, samplers, has_contacts }))
    }

    /// What the document uses beside its animation.
    fn kept(&mut self, control: &Control) -> Result<Vec<u8>, FormatError> {
        if let Some(kept) = &self.kept {
            return Ok(kept.clone());
        }
        let mut budget = Budget::new(&self.limits, control);
        let mut kept = vec![0; ALIGNMENT as usize];
        for piece in &self.pieces {
            let length = piece.end - piece.start;
            budget.take(Limit::DecodedBytes, length, "buffer views")?;
            kept.extend(read_bytes(&mut *self.reader, self.binary_offset + piece.start, length)?);
            kept.resize(kept.len().next_multiple_of(ALIGNMENT as usize), 0);
        }
        Ok(self.kept.insert(kept).clone())
    }
}

impl SectionedFile for GlbSections {
    fn format(&self) -> Format {
        self.format
    }

    fn times(&self) -> &ClipTimes {
        &self.times
    }

    fn has_contacts(&self) -> bool {
        self.has_contacts
    }

    fn section(&mut self, frames: Range<usize>, control: &Control) -> Result<Vec<u8>, FormatError> {
        let mut document = self.document.clone();
        let mut binary = self.kept(control)?;
        let mut place = |document: &mut Value, mut accessor: Value, count: usize, bytes: &[u8]| {
            let views = list(document, "bufferViews");
            views.push(json!({"buffer": 0, "byteOffset": binary.len(), "byteLength": bytes.len()}));
            accessor["bufferView"] = json!(views.len() - 1);
            accessor["count"] = json!(count);
            binary.extend_from_slice(bytes);
            binary.resize(binary.len().next_multiple_of(ALIGNMENT as usize), 0);
            let accessors = list(document, "accessors");
            accessors.push(accessor);
            accessors.len() - 1
        };
        let times: Vec<f32> = self.times.of_section(frames.clone()).into_iter().map(|time| time as f32).collect();
        let mut input = |document: &mut Value, times: &[f32]| {
            let bounds = (times.first(), times.last());
            let accessor = json!({"componentType": 5126, "type": "SCALAR", "min": [bounds.0], "max": [bounds.1]});
            place(document, accessor, times.len(), bytemuck::cast_slice(times))
        };
        let (sampled_input, constant_input) = (input(&mut document, &times), input(&mut document, &[0.0]));
        for index in 0..self.samplers.len() {
            control.check()?;
            let Samples { output, elements, width, is_constant } = self.samplers[index].clone();
            let (keys, input) = if is_constant { (0..1, constant_input) } else { (frames.clone(), sampled_input) };
            let count = keys.len() * width;
            let bytes =
                read_elements(&mut *self.reader, self.binary_offset, elements, keys.start * width..keys.end * width)?;
            let output = place(&mut document, output, count, &bytes);
            let sampler = &mut document["animations"][0]["samplers"][index];
            sampler["input"] = json!(input);
            sampler["output"] = json!(output);
        }
        document["buffers"][0]["byteLength"] = json!(binary.len());
        contain(document.to_string().as_bytes(), binary.len(), std::iter::once(binary.as_slice()))
    }

    fn reader(&mut self) -> &mut dyn ReadSeek {
        &mut *self.reader
    }
}

fn read_bytes(reader: &mut dyn ReadSeek, offset: u64, length: u64) -> Result<Vec<u8>, FormatError> {
    reader.seek(SeekFrom::Start(offset)).map_err(unreadable)?;
    let mut bytes = Vec::new();
    reader.take(length).read_to_end(&mut bytes).map_err(unreadable)?;
    if bytes.len() as u64 == length {
        return Ok(bytes);
    }
    let detail = format!("the file is cut short: {length} bytes are needed here and {} are there", bytes.len());
    Err(FormatError::malformed("container", format!("byte {offset}"), detail)
        .with_hint("check that the upload or the export was complete"))
}

fn word(bytes: &[u8], offset: usize) -> u32 {
    bytes.get(offset..offset + 4).and_then(|word| word.try_into().ok()).map_or(0, u32::from_le_bytes)
}

fn number(object: &Value, member: &str) -> Option<u64> {
    object.get(member)?.as_u64()
}

fn of_list<'d>(document: &'d Value, name: &str) -> &'d [Value] {
    document.get(name).and_then(Value::as_array).map_or(&[], Vec::as_slice)
}

/// A list of the document, empty where it has none.
fn list<'d>(document: &'d mut Value, name: &str) -> &'d mut Vec<Value> {
    let value = &mut document[name];
    if !value.is_array() {
        *value = Value::Array(Vec::new());
    }
    value.as_array_mut().expect("it is one now")
}
