//! A finished document to the bytes of a file.

use std::io::{Cursor, Write};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Map, Value};
use zip::{CompressionMethod, ZipWriter, result::ZipError, write::SimpleFileOptions};

use super::Output;
use crate::formats::{
    FormatError,
    gltf::container::{BINARY_CHUNK, CHUNK_HEADER_BYTES, HEADER_BYTES, JSON_CHUNK, MAGIC, VERSION},
    zipped::zip_error,
};

/// Names of the files in an archive.
const DOCUMENT_FILE: &str = "scene.gltf";
const BUFFER_FILE: &str = "scene.bin";
const DATA_URI: &str = "data:application/octet-stream;base64,";

/// A GLB: header, JSON chunk, and a binary chunk where there are bytes.
pub(super) fn glb(output: Output<'_>) -> Result<Vec<u8>, FormatError> {
    let Output { json, binary, .. } = output;
    contain(&to_text(&json)?, binary.length(), binary.pieces())
}

/// A document and its buffer as a GLB.
///
/// # Errors
/// When that has more than 4 GiB.
pub(in crate::formats) fn contain<'p>(
    json: &[u8],
    length: usize,
    pieces: impl Iterator<Item = &'p [u8]>,
) -> Result<Vec<u8>, FormatError> {
    let binary_length = length.next_multiple_of(4);
    let mut bytes = head(json, length, binary_length)?;
    let total = bytes.len() + binary_length;
    pieces.for_each(|piece| bytes.extend_from_slice(piece));
    bytes.resize(total, 0);
    Ok(bytes)
}

/// All of a GLB before the bytes of its buffer, which has that length; with room for so many of them.
///
/// # Errors
/// When it all has more than 4 GiB.
pub(super) fn head(json: &[u8], length: usize, room: usize) -> Result<Vec<u8>, FormatError> {
    let binary_length = length.next_multiple_of(4);
    let json_end = HEADER_BYTES + CHUNK_HEADER_BYTES + json.len().next_multiple_of(4);
    let binary_header = if length > 0 { CHUNK_HEADER_BYTES } else { 0 };
    let mut bytes = Vec::with_capacity(json_end + binary_header + room);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(word(json_end + binary_header + binary_length)?);
    bytes.extend(word(json.len().next_multiple_of(4))?);
    bytes.extend(JSON_CHUNK);
    bytes.extend(json);
    bytes.resize(json_end, b' ');
    if length > 0 {
        bytes.extend(word(binary_length)?);
        bytes.extend(BINARY_CHUNK);
    }
    Ok(bytes)
}

/// JSON with its buffer in a data URI.
pub(super) fn gltf(output: Output<'_>) -> Result<Vec<u8>, FormatError> {
    let Output { mut json, binary, .. } = output;
    if binary.length() > 0 {
        let mut bytes = Vec::with_capacity(binary.length());
        binary.pieces().for_each(|piece| bytes.extend_from_slice(piece));
        let mut uri = String::with_capacity(DATA_URI.len() + bytes.len().div_ceil(3) * 4);
        uri.push_str(DATA_URI);
        STANDARD.encode_string(&bytes, &mut uri);
        set_uri(&mut json, uri);
    }
    to_text(&json)
}

/// A zip archive with the JSON and its buffer in a file of its own. The same for the same document: fixed times, fixed order.
pub(super) fn zip(output: Output<'_>) -> Result<Vec<u8>, FormatError> {
    let Output { mut json, binary, .. } = output;
    let mut archive = ZipWriter::new(Cursor::new(Vec::new()));
    if binary.length() > 0 {
        set_uri(&mut json, BUFFER_FILE.into());
        // Images and floats hardly shrink.
        let method = CompressionMethod::Stored;
        add_file(&mut archive, BUFFER_FILE, method, binary.pieces(), binary.length())?;
    }
    let text = to_text(&json)?;
    add_file(&mut archive, DOCUMENT_FILE, CompressionMethod::Deflated, [text.as_slice()].into_iter(), text.len())?;
    Ok(archive.finish().map_err(|error| zip_error(&error, "archive"))?.into_inner())
}

fn add_file<'p>(
    archive: &mut ZipWriter<Cursor<Vec<u8>>>,
    name: &str,
    method: CompressionMethod,
    pieces: impl Iterator<Item = &'p [u8]>,
    length: usize,
) -> Result<(), FormatError> {
    let options = SimpleFileOptions::default()
        .compression_method(method)
        .last_modified_time(zip::DateTime::default())
        .large_file(u32::try_from(length).is_err());
    archive.start_file(name, options).map_err(|error| zip_error(&error, name))?;
    for piece in pieces {
        archive.write_all(piece).map_err(|error| zip_error(&ZipError::Io(error), name))?;
    }
    Ok(())
}

/// Says where the first buffer is.
fn set_uri(json: &mut Map<String, Value>, uri: String) {
    let buffer = json.get_mut("buffers").and_then(|buffers| buffers.get_mut(0)).and_then(Value::as_object_mut);
    if let Some(buffer) = buffer {
        buffer.insert("uri".into(), Value::String(uri));
    }
}

fn to_text(json: &Map<String, Value>) -> Result<Vec<u8>, FormatError> {
    serde_json::to_vec(json)
        .map_err(|error| FormatError::malformed("write", "", format!("the document cannot be written: {error}")))
}

fn word(length: usize) -> Result<[u8; 4], FormatError> {
    u32::try_from(length).map(u32::to_le_bytes).map_err(|_| {
        FormatError::unsupported(
            "write",
            "",
            format!("the output has {length} bytes, and a GLB cannot be larger than 4 GiB"),
            "split the clip, or ask for a BVH",
        )
    })
}
