//! A GLB that grows by the frames of one section of a clip after the other.
//!
//! How many frames there will be is known from the beginning, so the document is written first, and every array of the animation has its
//! place behind everything else. What each section adds is taken from a GLB that holds it alone.

use std::{collections::BTreeMap, io::SeekFrom, ops::Range};

use serde_json::{Value, json};

use super::pack::head;
use crate::{
    formats::{
        FormatError,
        gltf::container,
        sections::{ClipTimes, WriteSeek, unwritable},
    },
    model::Reporter,
};

/// Keys of the clip that the document is made from. One would be written in another way.
pub(in crate::formats) const FRAMES_OF_DOCUMENT: usize = 2;

/// Frames whose times are written at once.
const TIMES_AT_ONCE: usize = 1 << 16;

/// A node and what moves of it.
type ChannelKey = (u64, String);

/// A GLB on its way to the disk.
#[derive(Debug)]
pub(in crate::formats) struct GlbSectionWriter {
    /// Where in the file the arrays of the animation begin.
    arrays_offset: u64,
    /// Where behind that the array of a channel begins, and how many bytes a frame of it has.
    channels: BTreeMap<ChannelKey, (usize, usize)>,
}

impl GlbSectionWriter {
    /// Writes everything but the animation's values. `glb` has the first [`FRAMES_OF_DOCUMENT`] frames of the clip, with every track sampled.
    ///
    /// # Errors
    /// When the file would be larger than a GLB can be, or cannot be written.
    pub(in crate::formats) fn begin(
        glb: &[u8],
        times: &ClipTimes,
        sink: &mut dyn WriteSeek,
    ) -> Result<Self, FormatError> {
        let (mut document, binary) = parts(glb)?;
        let frames = times.frames();
        let found = arrays(&document)?;
        let view = found.first().map(|array| array.view).ok_or_else(|| unexpected("it has no animation"))?;
        if found.iter().any(|array| array.view != view || array.keys != FRAMES_OF_DOCUMENT) {
            return Err(unexpected("its animation does not lie in one view"));
        }
        let mut length = 0_usize;
        let (mut channels, mut inputs) = (BTreeMap::new(), Vec::new());
        let others = others(&document, view, &found)?;
        for array in found {
            let (place, bytes_of_frame) = (length, array.length / FRAMES_OF_DOCUMENT);
            length += bytes_of_frame * frames;
            let accessor = &mut document["accessors"][array.accessor];
            accessor["byteOffset"] = json!(place);
            accessor["count"] = json!(array.elements / FRAMES_OF_DOCUMENT * frames);
            match array.channel {
                Some(key) => drop(channels.insert(key, (place, bytes_of_frame))),
                None => {
                    let bound = |frame: usize| json!([times.seconds(frame) as f32]);
                    (accessor["min"], accessor["max"]) = (bound(0), bound(frames - 1));
                    inputs.push(place);
                }
            }
        }
        let mut kept = Vec::new();
        for other in others {
            let bytes = binary.get(other.offset..other.offset + other.length);
            document["accessors"][other.accessor]["byteOffset"] = json!(length);
            kept.push((length, bytes.ok_or_else(|| unexpected("an array is not in it"))?));
            length += other.length;
        }
        let base = binary.len().next_multiple_of(4);
        let whole = base + length;
        document["bufferViews"][view]["byteOffset"] = json!(base);
        document["bufferViews"][view]["byteLength"] = json!(length);
        document["buffers"][0]["byteLength"] = json!(whole);
        let mut head = head(document.to_string().as_bytes(), whole, binary.len())?;
        head.extend_from_slice(binary);
        head.resize(head.len().next_multiple_of(4), 0);
        sink.write_all(&head).map_err(unwritable)?;
        let writer = Self { arrays_offset: head.len() as u64, channels };
        for place in inputs {
            writer.times(times, place, sink)?;
        }
        for (place, bytes) in kept {
            writer.seek(place, sink)?;
            sink.write_all(bytes).map_err(unwritable)?;
        }
        Ok(writer)
    }

    /// To a place among the arrays.
    fn seek(&self, place: usize, sink: &mut dyn WriteSeek) -> Result<(), FormatError> {
        sink.seek(SeekFrom::Start(self.arrays_offset + place as u64)).map(drop).map_err(unwritable)
    }

    fn times(&self, times: &ClipTimes, place: usize, sink: &mut dyn WriteSeek) -> Result<(), FormatError> {
        self.seek(place, sink)?;
        for first in (0..times.frames()).step_by(TIMES_AT_ONCE) {
            let last = times.frames().min(first + TIMES_AT_ONCE);
            let seconds: Vec<f32> = (first..last).map(|frame| times.seconds(frame) as f32).collect();
            let before = first.checked_sub(1).map(|frame| times.seconds(frame) as f32);
            let is_rising = seconds.windows(2).all(|pair| pair[0] < pair[1]);
            if !is_rising || before.is_some_and(|before| before >= seconds[0]) {
                let detail = "the frames are closer than key times of glTF can tell so late in the clip";
                let hint = "ask for a BVH, or use fewer frames a second";
                return Err(FormatError::unsupported("write", "", detail, hint));
            }
            sink.write_all(bytemuck::cast_slice(&seconds)).map_err(unwritable)?;
        }
        Ok(())
    }

    /// Writes the values of these frames, which `glb` has, with every track sampled.
    ///
    /// # Errors
    /// When the section moves something that the first one did not, or the file cannot be written.
    pub(in crate::formats) fn add(
        &self,
        glb: &[u8],
        frames: Range<usize>,
        sink: &mut dyn WriteSeek,
    ) -> Result<(), FormatError> {
        let (document, binary) = parts(glb)?;
        let mut left = self.channels.len();
        for array in arrays(&document)? {
            let Some(key) = &array.channel else { continue };
            let bytes = binary.get(array.offset..array.offset + array.length);
            let place = self.channels.get(key).filter(|(_, element)| element * frames.len() == array.length);
            let Some(((place, element), bytes)) = place.zip(bytes) else {
                return Err(unexpected(&format!("node {} has another {} than before", key.0, key.1)));
            };
            self.seek(place + element * frames.start, sink)?;
            sink.write_all(bytes).map_err(unwritable)?;
            left -= 1;
        }
        if left > 0 { Err(unexpected("it moves less than those before")) } else { Ok(()) }
    }
}

/// An array of the first animation.
struct Array {
    /// The channel whose values it has; of key times nothing.
    channel: Option<ChannelKey>,
    accessor: usize,
    view: usize,
    keys: usize,
    /// As many as keys, or for each of them one per morph target.
    elements: usize,
    /// Bytes in the binary chunk.
    offset: usize,
    length: usize,
}

/// The arrays of the first animation, those of times too; every array of values has one channel.
fn arrays(document: &Value) -> Result<Vec<Array>, FormatError> {
    let animation = &document["animations"][0];
    let mut found = Vec::new();
    let mut inputs: Vec<usize> = Vec::new();
    for channel in animation["channels"].as_array().map_or(&[][..], Vec::as_slice) {
        let sampler = &animation["samplers"][index(&channel["sampler"])?];
        let (input, output) = (index(&sampler["input"])?, index(&sampler["output"])?);
        let keys = index(&document["accessors"][input]["count"])?;
        let target = &channel["target"];
        let node = target["node"].as_u64().ok_or_else(|| unexpected("a channel has no node"))?;
        let path = target["path"].as_str().unwrap_or_default().to_owned();
        if !inputs.contains(&input) {
            inputs.push(input);
            found.push(array(document, None, input, keys)?);
        }
        found.push(array(document, Some((node, path)), output, keys)?);
    }
    Ok(found)
}

/// What else lies in the view of the animation: the key of tracks that are constant, whether or not there are some.
fn others(document: &Value, view: usize, found: &[Array]) -> Result<Vec<Array>, FormatError> {
    let accessors = document["accessors"].as_array().map_or(&[][..], Vec::as_slice);
    let is_other = |(index, object): &(usize, &Value)| {
        object["bufferView"].as_u64() == Some(view as u64) && found.iter().all(|array| array.accessor != *index)
    };
    accessors.iter().enumerate().filter(is_other).map(|(index, _)| array(document, None, index, 0)).collect()
}

fn array(document: &Value, channel: Option<ChannelKey>, accessor: usize, keys: usize) -> Result<Array, FormatError> {
    let object = &document["accessors"][accessor];
    let view = index(&object["bufferView"])?;
    let offset = |object: &Value| object["byteOffset"].as_u64().unwrap_or(0) as usize;
    let components = match object["type"].as_str() {
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        _ => 1,
    };
    let elements = index(&object["count"])?;
    let offset = offset(object) + offset(&document["bufferViews"][view]);
    let length = elements * components * size_of::<f32>();
    Ok(Array { channel, accessor, view, keys, elements, offset, length })
}

fn parts(glb: &[u8]) -> Result<(Value, &[u8]), FormatError> {
    let parts = container::split(glb, &mut Reporter::new())?;
    let document = serde_json::from_slice(parts.json).map_err(|error| unexpected(&error.to_string()))?;
    Ok((document, parts.binary.unwrap_or_default()))
}

fn index(value: &Value) -> Result<usize, FormatError> {
    value.as_u64().map(|index| index as usize).ok_or_else(|| unexpected("an index is missing"))
}

/// What our own writer does not do.
fn unexpected(detail: &str) -> FormatError {
    FormatError::malformed("write", "/animations/0", format!("a section of the clip cannot be added: {detail}"))
        .with_hint("this is a bug; please report it")
}
