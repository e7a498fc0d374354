//! The arrays of an animation: as floats in one buffer view, with rotations in 16 bits, or each in a compressed view of its own.

use std::borrow::Cow;

use glam::Quat;
use serde_json::{Value, json};

use super::{FLOAT, Output, array};
use crate::formats::{Compression, FormatError, gltf::MESHOPT_EXTENSIONS};

const SHORT: u64 = 5122;
/// Components of compressed rotations have as many bits as the format allows.
const ROTATION_BITS: i32 = 16;
/// Of compressed translations and scales as many as keep a metre to the micrometre.
const MANTISSA_BITS: i32 = 20;
/// The best that is decoded as fast as the rest.
const COMPRESSION_LEVEL: i32 = 2;
/// The first version of the codec is the one that the extension describes.
const CODEC_VERSION: i32 = 0;

/// What an array holds, and with it how it may be stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Exact floats: times, and keys with tangents.
    Exact,
    /// Weights; exact too, but for small files.
    Scalars,
    /// Translations and scales.
    Vectors,
    /// Unit quaternions.
    Rotations,
}

/// Arrays on their way into the buffer.
pub(super) struct Streams<'o, 'a> {
    output: &'o mut Output<'a>,
    /// The one view of what is not compressed.
    view: usize,
    view_offset: usize,
}

impl<'o, 'a> Streams<'o, 'a> {
    pub(super) fn new(output: &'o mut Output<'a>) -> Result<Self, FormatError> {
        let view = array(&mut output.json, "bufferViews")?.len();
        let view_offset = output.binary.push(Cow::Borrowed(&[]));
        Ok(Self { output, view, view_offset })
    }

    /// Adds an array and gives the index of its accessor.
    pub(super) fn add<T: bytemuck::Pod>(
        &mut self,
        values: Cow<'a, [T]>,
        shape: &str,
        kind: Kind,
    ) -> Result<usize, FormatError> {
        let count = values.len();
        let is_short = kind == Kind::Rotations && self.output.compression != Compression::None;
        let mut accessor = if self.output.compression == Compression::Meshopt {
            json!({"bufferView": self.compressed(bytemuck::cast_slice(&values), count, kind)?})
        } else {
            let bytes = match values {
                _ if is_short => Cow::Owned(bytemuck::cast_slice(&shorts(bytemuck::cast_slice(&values))).to_vec()),
                Cow::Borrowed(values) => Cow::Borrowed(bytemuck::cast_slice(values)),
                Cow::Owned(values) => Cow::Owned(bytemuck::cast_slice(&values).to_vec()),
            };
            let offset = self.output.binary.push(bytes) - self.view_offset;
            json!({"bufferView": self.view, "byteOffset": offset})
        };
        accessor["componentType"] = json!(if is_short { SHORT } else { FLOAT });
        if is_short {
            accessor["normalized"] = json!(true);
        }
        accessor["count"] = json!(count);
        accessor["type"] = json!(shape);
        self.output.add_accessor(accessor)
    }

    /// Rotations as a reader will see them.
    pub(super) fn as_read(&self, rotations: &[Quat]) -> Vec<Quat> {
        let components: Vec<[f32; 4]> = rotations.iter().map(|rotation| rotation.to_array()).collect();
        let stored = match self.output.compression {
            Compression::None => return rotations.to_vec(),
            Compression::Quantized => shorts(&components),
            Compression::Meshopt => {
                let mut stored = meshopt::encode_filter_quat(&components, ROTATION_BITS);
                meshopt::decode_filter_quat(&mut stored);
                stored
            }
        };
        let float =
            |components: [i16; 4]| Quat::from_array(components.map(|short| f32::from(short) / f32::from(i16::MAX)));
        // Readers differ in whether they make them unit ones, by less than counts.
        stored.into_iter().map(|components| float(components).normalize()).collect()
    }

    /// An array of times, with the bounds that the specification asks for.
    pub(super) fn add_times(&mut self, times: Vec<f32>) -> Result<usize, FormatError> {
        let (first, last) = (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(0.0));
        let index = self.add(Cow::Owned(times), "SCALAR", Kind::Exact)?;
        let accessor = &mut array(&mut self.output.json, "accessors")?[index];
        accessor["min"] = json!([f64::from(first)]);
        accessor["max"] = json!([f64::from(last)]);
        Ok(index)
    }

    /// Adds a compressed view and gives its index. What it decodes to has a place in a buffer that is not there.
    fn compressed(&mut self, numbers: &[f32], count: usize, kind: Kind) -> Result<usize, FormatError> {
        let failed = |error: meshopt::Error| {
            FormatError::malformed("write", "/bufferViews", format!("the animation cannot be compressed: {error}"))
        };
        let width = numbers.len() / count.max(1);
        let (encoded, stride, filter) = match (kind, width) {
            (Kind::Rotations, _) => {
                let filtered = meshopt::encode_filter_quat(bytemuck::cast_slice(numbers), ROTATION_BITS);
                (encode(&filtered), 8, Some("QUATERNION"))
            }
            (Kind::Vectors, 3) => {
                let vectors: &[[f32; 3]] = bytemuck::cast_slice(numbers);
                let mode = meshopt::EncodeExpMode::SharedVector;
                (encode(&meshopt::encode_filter_exp(vectors, MANTISSA_BITS, mode)), 12, Some("EXPONENTIAL"))
            }
            (_, 3) => (encode(bytemuck::cast_slice::<_, [f32; 3]>(numbers)), 12, None),
            (_, 4) => (encode(bytemuck::cast_slice::<_, [f32; 4]>(numbers)), 16, None),
            _ => (encode(numbers), 4, None),
        };
        let encoded = encoded.map_err(failed)?;
        let (decoded_length, encoded_length) = (count * stride, encoded.len());
        let offset = self.output.binary.push(Cow::Owned(encoded));
        let mut compressed = json!({
            "buffer": 0,
            "byteOffset": offset,
            "byteLength": encoded_length,
            "byteStride": stride,
            "mode": "ATTRIBUTES",
            "count": count,
        });
        if let Some(filter) = filter {
            compressed["filter"] = json!(filter);
        }
        let views = array(&mut self.output.json, "bufferViews")?;
        views.push(json!({
            "buffer": self.output.decoded_buffer,
            "byteOffset": self.output.decoded_length,
            "byteLength": decoded_length,
            "extensions": {MESHOPT_EXTENSIONS[0]: compressed},
        }));
        self.output.decoded_length += decoded_length.next_multiple_of(16);
        Ok(views.len() - 1)
    }

    /// Adds the view of what is not compressed, now that its length is known.
    pub(super) fn finish(self) -> Result<(), FormatError> {
        if self.output.compression != Compression::Meshopt {
            array(&mut self.output.json, "bufferViews")?.push(json!({
                "buffer": 0,
                "byteOffset": self.view_offset,
                "byteLength": self.output.binary.length() - self.view_offset,
            }));
            return Ok(());
        }
        for list in ["extensionsUsed", "extensionsRequired"] {
            let names = array(&mut self.output.json, list)?;
            if !names.contains(&json!(MESHOPT_EXTENSIONS[0])) {
                names.push(MESHOPT_EXTENSIONS[0].into());
            }
        }
        Ok(())
    }
}

/// The buffer that compressed views decode into: only its length is there.
pub(super) fn decoded_buffer(length: usize) -> Value {
    json!({"byteLength": length, "extensions": {MESHOPT_EXTENSIONS[0]: {"fallback": true}}})
}

fn encode<T>(elements: &[T]) -> Result<Vec<u8>, meshopt::Error> {
    meshopt::encode_vertex_buffer_level(elements, COMPRESSION_LEVEL, Some(CODEC_VERSION))
}

/// Normalised shorts, as the specification rounds them.
fn shorts(rotations: &[[f32; 4]]) -> Vec<[i16; 4]> {
    let short = |component: f32| (component * f32::from(i16::MAX)).round().clamp(-32767.0, 32767.0) as i16;
    rotations.iter().map(|rotation| rotation.map(short)).collect()
}
