//! A finished document to the bytes of a file.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Map, Value};

use super::Output;
use crate::formats::{
    FormatError,
    gltf::container::{BINARY_CHUNK, CHUNK_HEADER_BYTES, HEADER_BYTES, JSON_CHUNK, MAGIC, VERSION},
};

const DATA_URI: &str = "data:application/octet-stream;base64,";

/// A GLB: header, JSON chunk, and a binary chunk where there are bytes.
pub(super) fn glb(output: Output<'_>) -> Result<Vec<u8>, FormatError> {
    let Output { json, binary } = output;
    let json = to_text(&json)?;
    let json_length = json.len().next_multiple_of(4);
    let binary_length = binary.length().next_multiple_of(4);
    let has_binary = binary.length() > 0;
    let total = HEADER_BYTES
        + CHUNK_HEADER_BYTES
        + json_length
        + if has_binary { CHUNK_HEADER_BYTES + binary_length } else { 0 };

    let mut bytes = Vec::with_capacity(total);
    bytes.extend(MAGIC);
    bytes.extend(VERSION.to_le_bytes());
    bytes.extend(word(total)?);
    bytes.extend(word(json_length)?);
    bytes.extend(JSON_CHUNK);
    bytes.extend(&json);
    bytes.resize(HEADER_BYTES + CHUNK_HEADER_BYTES + json_length, b' ');
    if has_binary {
        bytes.extend(word(binary_length)?);
        bytes.extend(BINARY_CHUNK);
        binary.pieces().for_each(|piece| bytes.extend_from_slice(piece));
        bytes.resize(total, 0);
    }
    Ok(bytes)
}

/// JSON with its buffer in a data URI.
pub(super) fn gltf(output: Output<'_>) -> Result<Vec<u8>, FormatError> {
    let Output { mut json, binary } = output;
    if binary.length() > 0 {
        let mut bytes = Vec::with_capacity(binary.length());
        binary.pieces().for_each(|piece| bytes.extend_from_slice(piece));
        let mut uri = String::with_capacity(DATA_URI.len() + bytes.len().div_ceil(3) * 4);
        uri.push_str(DATA_URI);
        STANDARD.encode_string(&bytes, &mut uri);
        let buffer = json.get_mut("buffers").and_then(|buffers| buffers.get_mut(0)).and_then(Value::as_object_mut);
        if let Some(buffer) = buffer {
            buffer.insert("uri".into(), Value::String(uri));
        }
    }
    to_text(&json)
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
            "split the clip",
        )
    })
}
