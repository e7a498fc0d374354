//! The arrays of an animation: as floats in one buffer view, with rotations in 16 bits, or each in a compressed view of its own.

use std::{borrow::Cow, collections::BTreeMap};

use glam::Quat;

use super::{
    Output, array,
    schema::{Accessor, Bounds, Buffer, BufferView, Component, CompressedView, Fallback, List, Shape},
};
use crate::formats::{Compression, FormatError, gltf::MESHOPT_EXTENSIONS};

/// Components of compressed rotations have as many bits as the format allows.
const ROTATION_BITS: i32 = 16;
/// Of compressed translations and scales as many as keep a meter to the micrometer.
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
        shape: Shape,
        kind: Kind,
    ) -> Result<usize, FormatError> {
        self.add_bounded(values, shape, kind, None)
    }

    fn add_bounded<T: bytemuck::Pod>(
        &mut self,
        values: Cow<'a, [T]>,
        shape: Shape,
        kind: Kind,
        bounds: Option<Bounds>,
    ) -> Result<usize, FormatError> {
        let count = values.len();
        let is_short = kind == Kind::Rotations && self.output.compression != Compression::None;
        let (view, byte_offset) = if self.output.compression == Compression::Meshopt {
            (self.compressed(bytemuck::cast_slice(&values), count, kind)?, None)
        } else {
            let bytes = match values {
                _ if is_short => Cow::Owned(bytemuck::cast_slice(&shorts(bytemuck::cast_slice(&values))).to_vec()),
                Cow::Borrowed(values) => Cow::Borrowed(bytemuck::cast_slice(values)),
                Cow::Owned(values) => Cow::Owned(bytemuck::cast_slice(&values).to_vec()),
            };
            let offset = self.output.binary.push(bytes) - self.view_offset;
            (self.view, Some(offset))
        };
        let component = if is_short { Component::Short } else { Component::Float };
        let accessor = Accessor::of_view(view, component, count, shape);
        self.output.add_accessor(&Accessor { byte_offset, normalized: is_short, bounds, ..accessor })
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
        let bounds = Bounds { min: vec![first], max: vec![last] };
        self.add_bounded(Cow::Owned(times), Shape::Scalar, Kind::Exact, Some(bounds))
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
        let compressed = CompressedView {
            buffer: 0,
            byte_offset: offset,
            byte_length: encoded_length,
            byte_stride: stride,
            mode: "ATTRIBUTES",
            count,
            filter,
        };
        let view = BufferView {
            buffer: self.output.decoded_buffer,
            byte_offset: self.output.decoded_length,
            byte_length: decoded_length,
            target: None,
            extensions: BTreeMap::from([(MESHOPT_EXTENSIONS[0], compressed)]),
        };
        self.output.decoded_length += decoded_length.next_multiple_of(16);
        self.output.push(List::BufferViews, &view)
    }

    /// Adds the view of what is not compressed, now that its length is known.
    pub(super) fn finish(self) -> Result<(), FormatError> {
        if self.output.compression != Compression::Meshopt {
            let view = BufferView {
                buffer: 0,
                byte_offset: self.view_offset,
                byte_length: self.output.binary.length() - self.view_offset,
                target: None,
                extensions: BTreeMap::new(),
            };
            return self.output.push(List::BufferViews, &view).map(drop);
        }
        for list in ["extensionsUsed", "extensionsRequired"] {
            let names = array(&mut self.output.json, list)?;
            if !names.iter().any(|name| name == MESHOPT_EXTENSIONS[0]) {
                names.push(MESHOPT_EXTENSIONS[0].into());
            }
        }
        Ok(())
    }
}

/// The buffer that compressed views decode into: only its length is there.
pub(super) fn decoded_buffer(length: usize) -> Buffer {
    let extensions = BTreeMap::from([(MESHOPT_EXTENSIONS[0], Fallback { fallback: true })]);
    Buffer { byte_length: length, extensions }
}

fn encode<T>(elements: &[T]) -> Result<Vec<u8>, meshopt::Error> {
    meshopt::encode_vertex_buffer_level(elements, COMPRESSION_LEVEL, Some(CODEC_VERSION))
}

/// Normalized shorts, as the specification rounds them.
fn shorts(rotations: &[[f32; 4]]) -> Vec<[i16; 4]> {
    let short = |component: f32| (component * f32::from(i16::MAX)).round().clamp(-32767.0, 32767.0) as i16;
    rotations.iter().map(|rotation| rotation.map(short)).collect()
}
