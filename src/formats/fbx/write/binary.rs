//! Records of binary FBX, version 7.4: how a tree of named records with properties lies in a file.
//!
//! Autodesk publishes no description of the container. What is written here is what the readers of the field agree on (the notes
//! of the Blender developers on the binary format, 2013, are the usual reference): little-endian records of end offset, property
//! count, property bytes and name; nested records end with thirteen zero bytes; a footer with two fixed signatures.

use std::{io::Write as _, sync::Arc};

use flate2::{Compression, write::ZlibEncoder};
use rayon::prelude::*;

pub(super) const VERSION: u32 = 7400;
/// Both belong to one another: readers by Autodesk check the id against the time.
pub(super) const FILE_ID: [u8; 16] =
    [0x28, 0xb3, 0x2a, 0xeb, 0xb6, 0x24, 0xcc, 0xc2, 0xbf, 0xc8, 0xb0, 0x2a, 0xa9, 0x2b, 0xfc, 0xf1];
pub(super) const CREATION_TIME: &str = "1970-01-01 10:00:00:000";

const MAGIC: &[u8] = b"Kaydara FBX Binary  \0\x1a\0";
const FOOTER_ID: [u8; 16] =
    [0xfa, 0xbc, 0xab, 0x09, 0xd0, 0xc8, 0xd4, 0x66, 0xb1, 0x76, 0xfb, 0x83, 0x1c, 0xf7, 0x26, 0x7e];
const FOOTER_MAGIC: [u8; 16] =
    [0xf8, 0x5a, 0x8c, 0x6a, 0xde, 0xf5, 0xd9, 0x7e, 0xec, 0xe9, 0x0c, 0xe3, 0x75, 0x8f, 0x29, 0x0b];
/// The end of a list of nested records.
const NULL_RECORD: [u8; 13] = [0; 13];
/// Arrays below this size are not worth compressing: making the compressor ready takes longer than the rest, and files of skins have
/// thousands of matrices.
const COMPRESSED_FROM_BYTES: usize = 1024;

/// A record: its name, its properties, and the records within it.
#[derive(Debug)]
pub(super) struct Record {
    name: &'static str,
    properties: Vec<Property>,
    records: Vec<Self>,
}

/// A typed value.
#[derive(Debug)]
pub(super) enum Property {
    Whole(i32),
    Long(i64),
    Number(f64),
    Text(String),
    Bytes(Vec<u8>),
    Wholes(Vec<i32>),
    Numbers(Vec<f64>),
    /// As it lies in the file already; several records may have the same one.
    Array(Arc<Array>),
}

/// An array as it lies in a file.
#[derive(Debug)]
pub(super) struct Array {
    tag: u8,
    count: usize,
    is_deflated: bool,
    bytes: Vec<u8>,
}

/// What arrays are made with. Its compressor is used again for each: a new one touches 300 KB of memory.
pub(super) struct Packer(ZlibEncoder<Vec<u8>>);

impl Default for Packer {
    fn default() -> Self {
        Self(ZlibEncoder::new(Vec::new(), Compression::fast()))
    }
}

impl Packer {
    pub(super) fn wholes(&mut self, values: &[i32]) -> Arc<Array> {
        self.array(b'i', values, i32::to_le_bytes)
    }

    pub(super) fn longs(&mut self, values: &[i64]) -> Arc<Array> {
        self.array(b'l', values, i64::to_le_bytes)
    }

    pub(super) fn singles(&mut self, values: &[f32]) -> Arc<Array> {
        self.array(b'f', values, f32::to_le_bytes)
    }

    pub(super) fn numbers(&mut self, values: &[f64]) -> Arc<Array> {
        self.array(b'd', values, f64::to_le_bytes)
    }

    fn array<T: Copy, const N: usize>(&mut self, tag: u8, values: &[T], bytes_of: fn(T) -> [u8; N]) -> Arc<Array> {
        let mut plain = vec![0; values.len() * N];
        for (bytes, value) in plain.as_chunks_mut::<N>().0.iter_mut().zip(values) {
            *bytes = bytes_of(*value);
        }
        let deflated = if plain.len() >= COMPRESSED_FROM_BYTES { self.deflated(&plain) } else { None };
        let is_deflated = deflated.is_some();
        Arc::new(Array { tag, count: values.len(), is_deflated, bytes: deflated.unwrap_or(plain) })
    }

    /// Writing to memory does not fail; if it did, the array would be stored as it is.
    fn deflated(&mut self, plain: &[u8]) -> Option<Vec<u8>> {
        let written = self.0.write_all(plain);
        let bytes = self.0.reset(Vec::new());
        written.and(bytes).ok()
    }

    /// Turns an array of numbers into what lies in the file.
    fn pack(&mut self, property: &mut Property) {
        let array = match property {
            Property::Wholes(values) => self.wholes(values),
            Property::Numbers(values) => self.numbers(values),
            _ => return,
        };
        *property = Property::Array(array);
    }
}

impl From<Arc<Array>> for Property {
    fn from(array: Arc<Array>) -> Self {
        Self::Array(array)
    }
}

impl From<i32> for Property {
    fn from(value: i32) -> Self {
        Self::Whole(value)
    }
}

impl From<i64> for Property {
    fn from(value: i64) -> Self {
        Self::Long(value)
    }
}

impl From<f64> for Property {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<&str> for Property {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl From<String> for Property {
    fn from(value: String) -> Self {
        Self::Text(value)
    }
}

impl Record {
    pub(super) const fn new(name: &'static str) -> Self {
        Self { name, properties: Vec::new(), records: Vec::new() }
    }

    /// With one more property.
    pub(super) fn with(mut self, property: impl Into<Property>) -> Self {
        self.properties.push(property.into());
        self
    }

    /// With a record of one property in it.
    pub(super) fn field(self, name: &'static str, property: impl Into<Property>) -> Self {
        self.holding([Self::new(name).with(property)])
    }

    /// With records in it.
    pub(super) fn holding(mut self, records: impl IntoIterator<Item = Self>) -> Self {
        self.records.extend(records);
        self
    }

    /// All arrays of numbers in it that are not packed yet.
    fn collect_arrays<'a>(&'a mut self, arrays: &mut Vec<&'a mut Property>) {
        let is_array = |property: &&mut Property| matches!(property, Property::Wholes(_) | Property::Numbers(_));
        arrays.extend(self.properties.iter_mut().filter(is_array));
        self.records.iter_mut().for_each(|record| record.collect_arrays(arrays));
    }

    /// Appends the record; offsets count from the start of `out`.
    fn write(&self, out: &mut Vec<u8>) -> Option<()> {
        let start = out.len();
        out.extend_from_slice(&[0; 4]);
        out.extend_from_slice(&u32::try_from(self.properties.len()).ok()?.to_le_bytes());
        out.extend_from_slice(&[0; 4]);
        out.push(u8::try_from(self.name.len()).ok()?);
        out.extend_from_slice(self.name.as_bytes());
        let properties = out.len();
        for property in &self.properties {
            property.write(out)?;
        }
        let property_bytes = u32::try_from(out.len() - properties).ok()?;
        for record in &self.records {
            record.write(out)?;
        }
        // A record with neither properties nor records ends like one with records; readers tell it from the end by that.
        if !self.records.is_empty() || self.properties.is_empty() {
            out.extend_from_slice(&NULL_RECORD);
        }
        let end = u32::try_from(out.len()).ok()?;
        out[start..start + 4].copy_from_slice(&end.to_le_bytes());
        out[start + 8..start + 12].copy_from_slice(&property_bytes.to_le_bytes());
        Some(())
    }
}

impl Property {
    fn write(&self, out: &mut Vec<u8>) -> Option<()> {
        match self {
            Self::Whole(value) => tagged(out, b'I', &value.to_le_bytes()),
            Self::Long(value) => tagged(out, b'L', &value.to_le_bytes()),
            Self::Number(value) => tagged(out, b'D', &value.to_le_bytes()),
            Self::Text(text) => sized(out, b'S', text.as_bytes())?,
            Self::Bytes(bytes) => sized(out, b'R', bytes)?,
            Self::Array(array) => array.write(out)?,
            Self::Wholes(values) => Packer::default().wholes(values).write(out)?,
            Self::Numbers(values) => Packer::default().numbers(values).write(out)?,
        }
        Some(())
    }
}

fn tagged(out: &mut Vec<u8>, tag: u8, bytes: &[u8]) {
    out.push(tag);
    out.extend_from_slice(bytes);
}

fn sized(out: &mut Vec<u8>, tag: u8, bytes: &[u8]) -> Option<()> {
    out.push(tag);
    out.extend_from_slice(&u32::try_from(bytes.len()).ok()?.to_le_bytes());
    out.extend_from_slice(bytes);
    Some(())
}

impl Array {
    fn write(&self, out: &mut Vec<u8>) -> Option<()> {
        out.push(self.tag);
        out.extend_from_slice(&u32::try_from(self.count).ok()?.to_le_bytes());
        out.extend_from_slice(&u32::from(self.is_deflated).to_le_bytes());
        out.extend_from_slice(&u32::try_from(self.bytes.len()).ok()?.to_le_bytes());
        out.extend_from_slice(&self.bytes);
        Some(())
    }
}

/// A whole file; nothing where it would be larger than its 32-bit offsets can say.
pub(super) fn file(mut records: Vec<Record>) -> Option<Vec<u8>> {
    let mut arrays = Vec::new();
    records.iter_mut().for_each(|record| record.collect_arrays(&mut arrays));
    arrays.into_par_iter().for_each_init(Packer::default, |packer, array| packer.pack(array));
    let mut out = MAGIC.to_vec();
    out.extend_from_slice(&VERSION.to_le_bytes());
    for record in &records {
        record.write(&mut out)?;
    }
    out.extend_from_slice(&NULL_RECORD);
    out.extend_from_slice(&FOOTER_ID);
    out.extend_from_slice(&[0; 4]);
    // One to sixteen bytes up to the next multiple of sixteen.
    out.resize((out.len() / 16 + 1) * 16, 0);
    out.extend_from_slice(&VERSION.to_le_bytes());
    out.extend_from_slice(&[0; 120]);
    out.extend_from_slice(&FOOTER_MAGIC);
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_compressor_that_is_used_again_gives_the_bytes_of_a_new_one() {
        let noise = |seed: u32| move |index: u32| (index.wrapping_mul(2_654_435_761).wrapping_add(seed) >> 9) as f32;
        let arrays: Vec<Vec<f32>> = vec![
            (0..40_000).map(noise(7)).collect(),
            vec![1.5; 3_000],
            (0..31).map(noise(1)).collect(),
            (0..500).map(noise(3)).collect(),
            (0..40_000).map(noise(7)).collect(),
        ];
        let mut packer = Packer::default();
        for values in &arrays {
            let (again, new) = (packer.singles(values), Packer::default().singles(values));
            assert_eq!(
                (again.is_deflated, &again.bytes),
                (values.len() * 4 >= COMPRESSED_FROM_BYTES, &new.bytes),
                "{} values",
                values.len()
            );
            let mut plain = Vec::new();
            if again.is_deflated {
                let mut decoder = flate2::write::ZlibDecoder::new(&mut plain);
                decoder.write_all(&again.bytes).expect("it inflates");
                decoder.finish().expect("whole");
            } else {
                plain.clone_from(&again.bytes);
            }
            assert!(plain.chunks(4).eq(values.iter().map(|value| value.to_le_bytes())), "the same numbers");
        }
    }
}
