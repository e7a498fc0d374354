//! A GLB in sections: its document with the keys of some frames, in place of those of all.
//!
//! Only what the one animation of the file uses is cut: every sampler is given accessors and views of its own, behind what the rest of
//! the document uses, which stays as it is.

use std::{
    collections::{BTreeMap, BTreeSet},
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

/// Where elements lie in the binary chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Elements {
    offset: u64,
    stride: usize,
    /// Bytes of one of them.
    size: usize,
    count: usize,
}

/// What one sampler of the animation holds.
#[derive(Clone, Debug)]
struct Samples {
    /// The accessor of its values, of which all but the count, the view and the bounds stays.
    output: Value,
    elements: Elements,
    /// Elements of one key.
    width: usize,
    /// Whether it has one value for the whole clip.
    is_constant: bool,
}

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
            return Ok(Err("the joints of the clip have keys at times that differ, or that do not rise"));
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
}

impl GlbSections {
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

/// Where the key times of the animation are, and what its samplers hold.
fn samplers(document: &Value, binary_bytes: u64) -> Result<(Vec<Elements>, Vec<Samples>), WholeOnly> {
    let [buffer] = of_list(document, "buffers") else { return Err("the file does not have one buffer") };
    if !buffer.is_object() || buffer.get("uri").is_some() {
        return Err("the buffer of the GLB is not its binary chunk");
    }
    let [animation] = of_list(document, "animations") else { return Err("the file does not have one animation") };
    if animation.pointer("/extras/curves").is_some() {
        return Err("the animation has curves of custom properties");
    }
    let mut pairs = Vec::new();
    for sampler in of_list(animation, "samplers") {
        if sampler.get("interpolation").is_some_and(|name| name != "LINEAR") {
            return Err("the animation has curves or steps between its keys");
        }
        let (input, output) = (accessor(document, sampler, "input")?, accessor(document, sampler, "output")?);
        let (of_input, of_output) =
            (elements(document, input, binary_bytes)?, elements(document, output, binary_bytes)?);
        if of_input.size != 4 || input["componentType"] != 5126 {
            return Err("the key times of the animation are not floats");
        }
        pairs.push((of_input, of_output, output.clone()));
    }
    let frames = pairs.iter().map(|(input, ..)| input.count).max().ok_or("the animation has no samplers")?;
    let mut inputs: Vec<Elements> = Vec::new();
    let mut all = Vec::with_capacity(pairs.len());
    for (input, output_elements, mut output) in pairs {
        let is_constant = input.count <= 2 && frames > 2;
        if !is_constant && input.count != frames || !output_elements.count.is_multiple_of(input.count) {
            return Err("the joints of the clip have keys at times that differ");
        }
        if !is_constant && !inputs.contains(&input) {
            inputs.push(input);
        }
        if let Some(object) = output.as_object_mut() {
            // Bounds are those of all values, and where these begin is said by a view of their own.
            ["min", "max", "byteOffset", "name"].iter().for_each(|key| drop(object.shift_remove(*key)));
        }
        all.push(Samples {
            output,
            elements: output_elements,
            width: output_elements.count / input.count,
            is_constant,
        });
    }
    Ok((inputs, all))
}

/// The times of all keys, where all inputs say the same and they rise.
fn common_times(
    reader: &mut dyn ReadSeek,
    binary_offset: u64,
    inputs: &[Elements],
    budget: &mut Budget<'_>,
) -> Result<Option<ClipTimes>, FormatError> {
    let mut common: Option<Vec<u8>> = None;
    for input in inputs {
        budget.check_canceled()?;
        // One for each joint, in files of some exporters: no more than two are in memory at once.
        budget.check(Limit::DecodedBytes, (input.count * input.size) as u64, "key times")?;
        let bytes = read_elements(reader, binary_offset, *input, 0..input.count)?;
        match &common {
            Some(common) if *common != bytes => return Ok(None),
            Some(_) => {}
            None => common = Some(bytes),
        }
    }
    let times: Vec<f32> = common
        .unwrap_or_default()
        .chunks_exact(4)
        .map(|time| f32::from_le_bytes([time[0], time[1], time[2], time[3]]))
        .collect();
    Ok(ClipTimes::of_keys(&times))
}

/// Whether all keys of a sampler with few of them have one value.
fn is_still(reader: &mut dyn ReadSeek, binary_offset: u64, sampler: &Samples) -> Result<bool, FormatError> {
    let bytes = read_elements(reader, binary_offset, sampler.elements, 0..sampler.elements.count)?;
    let one = sampler.width * sampler.elements.size;
    Ok(bytes.chunks_exact(one).all(|key| key == &bytes[..one]))
}

/// The accessor that a member of a sampler names.
fn accessor<'d>(document: &'d Value, sampler: &Value, member: &str) -> Result<&'d Value, WholeOnly> {
    let index = number(sampler, member).ok_or("a sampler of the animation names no accessor")?;
    of_list(document, "accessors").get(index as usize).ok_or("a sampler of the animation names no accessor")
}

/// Where the elements of an accessor are.
fn elements(document: &Value, accessor: &Value, binary_bytes: u64) -> Result<Elements, WholeOnly> {
    const UNFIT: WholeOnly = "an accessor of the animation is sparse, compressed or broken";
    let view = number(accessor, "bufferView").and_then(|view| of_list(document, "bufferViews").get(view as usize));
    let view = view.filter(|_| accessor.get("sparse").is_none()).ok_or(UNFIT)?;
    if view.get("extensions").is_some() || number(view, "buffer") != Some(0) {
        return Err(UNFIT);
    }
    let component = match number(accessor, "componentType") {
        Some(5120 | 5121) => 1,
        Some(5122 | 5123) => 2,
        Some(5126) => 4,
        _ => return Err(UNFIT),
    };
    let components = match accessor["type"].as_str() {
        Some("SCALAR") => 1,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => return Err(UNFIT),
    };
    let size: usize = component * components;
    let stride = number(view, "byteStride").map_or(size, |stride| stride as usize);
    let count = number(accessor, "count").filter(|count| *count > 0).ok_or(UNFIT)?;
    let offset = |object: &Value| number(object, "byteOffset").unwrap_or(0);
    let first = offset(view).checked_add(offset(accessor)).ok_or(UNFIT)?;
    let end = (count - 1).checked_mul(stride as u64).and_then(|last| first.checked_add(last)?.checked_add(size as u64));
    if stride < size || end.is_none_or(|end| end > binary_bytes) {
        return Err(UNFIT);
    }
    Ok(Elements { offset: first, stride, size, count: count as usize })
}

fn read_elements(
    reader: &mut dyn ReadSeek,
    binary_offset: u64,
    elements: Elements,
    range: Range<usize>,
) -> Result<Vec<u8>, FormatError> {
    let Elements { offset, stride, size, .. } = elements;
    let Some(last) = range.end.checked_sub(1).filter(|_| !range.is_empty()) else { return Ok(Vec::new()) };
    let length = (last - range.start) * stride + size;
    let bytes = read_bytes(reader, binary_offset + offset + (range.start * stride) as u64, length as u64)?;
    if stride == size {
        return Ok(bytes);
    }
    Ok(bytes.chunks(stride).flat_map(|element| &element[..size]).copied().collect())
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

/// The views that anything but the animation uses.
fn kept_views(document: &Value) -> BTreeSet<u64> {
    let of_animation: BTreeSet<u64> = of_list(document, "animations")
        .iter()
        .flat_map(|animation| of_list(animation, "samplers"))
        .flat_map(|sampler| [number(sampler, "input"), number(sampler, "output")])
        .flatten()
        .collect();
    let mut kept = BTreeSet::new();
    let accessors = of_list(document, "accessors").iter().zip(0..);
    for (accessor, _) in accessors.filter(|(_, index)| !of_animation.contains(index)) {
        named_views(accessor, &mut kept);
    }
    let rest = document.as_object().into_iter().flatten();
    for (_, value) in rest.filter(|(name, _)| !["accessors", "animations"].contains(&name.as_str())) {
        named_views(value, &mut kept);
    }
    kept
}

/// Adds every view that is named anywhere in a value.
fn named_views(value: &Value, found: &mut BTreeSet<u64>) {
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value {
            Value::Array(values) => open.extend(values),
            Value::Object(members) => {
                found.extend(members.get("bufferView").and_then(Value::as_u64));
                open.extend(members.values());
            }
            _ => {}
        }
    }
}

/// Has kept views lie one behind the other, and leaves all others with a byte of what lies before them. Gives what is to lie there: the bytes of
/// the file's binary chunk from one number to another. Views may share bytes, which are kept once.
fn move_views(document: &mut Value, kept: &BTreeSet<u64>, binary_bytes: u64) -> Result<Vec<Range<u64>>, WholeOnly> {
    const OUTSIDE: WholeOnly = "a buffer view of the GLB is not inside its binary chunk";
    let (mut pieces, mut end): (Vec<Range<u64>>, u64) = (Vec::new(), ALIGNMENT);
    let mut moved: BTreeMap<(u64, u64), u64> = BTreeMap::new();
    for (view, index) in list(document, "bufferViews").iter_mut().zip(0..) {
        if !kept.contains(&index) {
            *view = json!({"buffer": 0, "byteOffset": 0, "byteLength": 1});
            continue;
        }
        // A compressed form is named by numbers of its own.
        if view.get("extensions").is_some() {
            return Err("the GLB has compressed buffer views");
        }
        let (Some(length), offset) = (number(view, "byteLength"), number(view, "byteOffset").unwrap_or(0)) else {
            return Err(OUTSIDE);
        };
        let last = offset.checked_add(length).filter(|last| number(view, "buffer") == Some(0) && *last <= binary_bytes);
        let last = last.ok_or(OUTSIDE)?;
        let at = *moved.entry((offset, length)).or_insert_with(|| {
            let at = end;
            pieces.push(offset..last);
            end = (at + length).next_multiple_of(ALIGNMENT);
            at
        });
        view["byteOffset"] = json!(at);
    }
    Ok(pieces)
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
