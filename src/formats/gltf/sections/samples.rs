//! What the samplers of an animation hold, and where in the file.

use std::ops::Range;

use serde_json::Value;

use super::{WholeOnly, number, of_list, read_bytes};
use crate::formats::{
    Budget, FormatError, Limit,
    sections::{ClipTimes, ReadSeek},
};

/// Where elements lie in the binary chunk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Elements {
    offset: u64,
    stride: usize,
    /// Bytes of one of them.
    size: usize,
    count: usize,
}

/// What one sampler of the animation holds.
#[derive(Clone, Debug)]
pub(super) struct Samples {
    /// The accessor of its values, of which all but the count, the view and the bounds stays.
    pub(super) output: Value,
    pub(super) elements: Elements,
    /// Elements of one key.
    pub(super) width: usize,
    /// Whether it has one value for the whole clip.
    pub(super) is_constant: bool,
}

/// Where the key times of the animation are, and what its samplers hold.
pub(super) fn samplers(document: &Value, binary_bytes: u64) -> Result<(Vec<Elements>, Vec<Samples>), WholeOnly> {
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
pub(super) fn common_times(
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
    Ok(ClipTimes::of_keys(&times).filter(|times| times.seconds(0) >= 0.0))
}

/// Whether all keys of a sampler with few of them have one value.
pub(super) fn is_still(reader: &mut dyn ReadSeek, binary_offset: u64, sampler: &Samples) -> Result<bool, FormatError> {
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

pub(super) fn read_elements(
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
