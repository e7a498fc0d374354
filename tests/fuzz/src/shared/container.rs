//! Files within files: taken apart and put together again.

use std::io::{Cursor, Read, Write};

use zip::{CompressionMethod, ZipArchive, ZipWriter, write::SimpleFileOptions};

/// More members or bytes than these are not taken apart.
const MAX_PARTS: usize = 64;
const MAX_PART_BYTES: u64 = 1 << 20;
const NUMPY_PRELUDE_BYTES: usize = 10;

/// A file that holds parts.
pub(super) struct Container {
    kind: Kind,
    pub(super) parts: Vec<Part>,
}

#[derive(Clone)]
pub(super) struct Part {
    name: String,
    pub(super) bytes: Vec<u8>,
}

#[derive(Clone, Copy)]
enum Kind {
    Glb,
    Zip,
    /// A header and the array after it.
    Numpy,
}

impl Container {
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let (kind, parts) = if bytes.starts_with(b"glTF") {
            (Kind::Glb, chunks(bytes)?)
        } else if bytes.starts_with(b"PK\x03\x04") {
            (Kind::Zip, members(bytes)?)
        } else if bytes.starts_with(b"\x93NUMPY\x01") {
            let length = u16::from_le_bytes([*bytes.get(8)?, *bytes.get(9)?]);
            let (header, data) = bytes[NUMPY_PRELUDE_BYTES..].split_at_checked(length.into())?;
            (Kind::Numpy, vec![Part::new("header", header), Part::new("data", data)])
        } else {
            return None;
        };
        Some(Self { kind, parts })
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        match self.kind {
            Kind::Glb => glb(&self.parts),
            Kind::Zip => archive(&self.parts),
            Kind::Numpy => {
                let mut bytes = b"\x93NUMPY\x01\0".to_vec();
                let header = self.parts.first().map_or(&[][..], |part| &part.bytes);
                bytes.extend((header.len() as u16).to_le_bytes());
                bytes.extend(self.parts.iter().flat_map(|part| &part.bytes));
                bytes
            }
        }
    }
}

impl Part {
    pub(super) fn new(name: &str, bytes: &[u8]) -> Self {
        Self { name: name.to_owned(), bytes: bytes.to_vec() }
    }
}

fn chunks(bytes: &[u8]) -> Option<Vec<Part>> {
    let mut parts = Vec::new();
    let mut rest = bytes.get(12..)?;
    while let Some((header, after)) = rest.split_at_checked(8) {
        let length = u32::from_le_bytes(header[..4].try_into().ok()?) as usize;
        let (chunk, after) = after.split_at(length.min(after.len()));
        parts.push(Part { name: header[4..].iter().map(|byte| char::from(*byte)).collect(), bytes: chunk.to_vec() });
        rest = after;
        if parts.len() == MAX_PARTS {
            break;
        }
    }
    Some(parts)
}

/// A GLB of chunks, which are filled up to multiples of four.
pub(super) fn glb(parts: &[Part]) -> Vec<u8> {
    let mut body = Vec::new();
    for part in parts {
        let padding = if part.name == "JSON" { b' ' } else { 0 };
        let length = part.bytes.len().next_multiple_of(4);
        body.extend((length as u32).to_le_bytes());
        body.extend(part.name.chars().map(|letter| letter as u8));
        body.extend(&part.bytes);
        body.resize(body.len() + length - part.bytes.len(), padding);
    }
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((12 + body.len() as u32).to_le_bytes());
    bytes.extend(body);
    bytes
}

fn members(bytes: &[u8]) -> Option<Vec<Part>> {
    let mut zip = ZipArchive::new(Cursor::new(bytes)).ok()?;
    if zip.len() > MAX_PARTS {
        return None;
    }
    let mut parts = Vec::with_capacity(zip.len());
    for index in 0..zip.len() {
        let member = zip.by_index(index).ok()?;
        let name = member.name().ok()?.into_owned();
        let mut bytes = Vec::new();
        member.take(MAX_PART_BYTES).read_to_end(&mut bytes).ok()?;
        parts.push(Part { name, bytes });
    }
    Some(parts)
}

/// An archive of members, packed as they are; empty where two have one name, which the writer refuses.
pub(super) fn archive(parts: &[Part]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(zip::DateTime::default());
    for part in parts {
        if zip.start_file(part.name.clone(), options).is_ok() {
            // It is written into memory, which takes it.
            let _ = zip.write_all(&part.bytes);
        }
    }
    zip.finish().map(Cursor::into_inner).unwrap_or_default()
}
