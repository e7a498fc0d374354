//! Where the JSON and the binary chunk of a file are: splits a GLB, and lets plain JSON through.

use crate::{formats::FormatError, model::Reporter};

/// The two parts of a file.
#[derive(Debug)]
pub(super) struct Parts<'a> {
    /// The JSON text, without a byte order mark.
    pub(super) json: &'a [u8],
    /// The binary chunk, where there is one.
    pub(super) binary: Option<&'a [u8]>,
}

/// Bytes of the GLB header.
pub(super) const HEADER_BYTES: usize = 12;
/// Bytes of a chunk's header.
pub(super) const CHUNK_HEADER_BYTES: usize = 8;
/// The first four bytes of a GLB.
pub(in crate::formats) const MAGIC: [u8; 4] = *b"glTF";
/// The version of the container and of the document that we read and write.
pub(super) const VERSION: u32 = 2;
/// Type of the chunk with the document.
pub(super) const JSON_CHUNK: [u8; 4] = *b"JSON";
/// Type of the chunk with the first buffer.
pub(super) const BINARY_CHUNK: [u8; 4] = *b"BIN\0";

const PHASE: &str = "container";

/// Splits a file. The bytes decide whether it is a GLB.
pub(super) fn split<'a>(bytes: &'a [u8], reporter: &mut Reporter) -> Result<Parts<'a>, FormatError> {
    let parts =
        if bytes.starts_with(&MAGIC) { split_glb(bytes, reporter)? } else { Parts { json: bytes, binary: None } };
    let Some(json) = parts.json.strip_prefix(b"\xef\xbb\xbf") else { return Ok(parts) };
    reporter.warn("byte_order_mark", "", "the JSON begins with a byte order mark, which was skipped", "");
    Ok(Parts { json, ..parts })
}

fn split_glb<'a>(bytes: &'a [u8], reporter: &mut Reporter) -> Result<Parts<'a>, FormatError> {
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        return Err(cut_short(0, HEADER_BYTES, bytes.len()));
    };
    if version != VERSION {
        return Err(FormatError::unsupported(
            PHASE,
            "byte 4",
            format!("this is a GLB of version {version}; only version {VERSION} can be read"),
            "convert the file to glTF 2.0",
        ));
    }
    let length = length as usize;
    let Some(body) = bytes.get(..length) else {
        return Err(FormatError::malformed(
            PHASE,
            "byte 8",
            format!("the header says {length} bytes, but the file has {}: it was cut short", bytes.len()),
        )
        .with_hint("check that the upload or the export was complete"));
    };
    if length < bytes.len() {
        let detail = format!("{} bytes after the end of the GLB were left out", bytes.len() - length);
        reporter.warn("trailing_bytes", format!("byte {length}"), detail, "");
    }
    split_chunks(body, reporter)
}

fn split_chunks<'a>(body: &'a [u8], reporter: &mut Reporter) -> Result<Parts<'a>, FormatError> {
    let mut json = None;
    let mut binary = None;
    let mut offset = HEADER_BYTES;
    while offset < body.len() {
        let (Some(length), Some(kind)) = (word(body, offset), body.get(offset + 4..offset + CHUNK_HEADER_BYTES)) else {
            return Err(cut_short(offset, CHUNK_HEADER_BYTES, body.len() - offset));
        };
        let start = offset + CHUNK_HEADER_BYTES;
        let chunk = start.checked_add(length as usize).and_then(|end| body.get(start..end));
        let Some(chunk) = chunk else { return Err(cut_short(offset, length as usize, body.len() - start)) };
        if !chunk.len().is_multiple_of(4) {
            let detail = format!("a chunk of {length} bytes is not a multiple of four long; it was read as it is");
            reporter.warn("chunk_not_aligned", format!("byte {offset}"), detail, "");
        }
        if json.is_none() {
            if kind != JSON_CHUNK {
                return Err(FormatError::malformed(
                    PHASE,
                    format!("byte {offset}"),
                    format!("the first chunk must be 'JSON', not '{}'", kind.escape_ascii()),
                ));
            }
            json = Some(chunk);
        } else if kind == BINARY_CHUNK && binary.is_none() {
            binary = Some(chunk);
        } else {
            let detail =
                format!("a chunk '{}' of {length} bytes is not understood and was left out", kind.escape_ascii());
            reporter.warn("unknown_chunk", format!("byte {offset}"), detail, "");
        }
        offset = start + chunk.len();
    }
    let json = json.ok_or_else(|| FormatError::malformed(PHASE, "", "the GLB has no JSON chunk"))?;
    Ok(Parts { json, binary })
}

fn word(bytes: &[u8], offset: usize) -> Option<u32> {
    let end = offset.checked_add(4)?;
    bytes.get(offset..end)?.try_into().ok().map(u32::from_le_bytes)
}

fn cut_short(offset: usize, needed: usize, there: usize) -> FormatError {
    FormatError::malformed(
        PHASE,
        format!("byte {offset}"),
        format!("the file is cut short: {needed} bytes are needed here and {there} are there"),
    )
    .with_hint("check that the upload or the export was complete")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
        let mut body = Vec::new();
        for (kind, data) in chunks {
            body.extend((data.len() as u32).to_le_bytes());
            body.extend(*kind);
            body.extend(*data);
        }
        let mut bytes = b"glTF\x02\0\0\0".to_vec();
        bytes.extend((body.len() as u32 + 12).to_le_bytes());
        bytes.extend(body);
        bytes
    }

    fn codes(bytes: &[u8]) -> Vec<&'static str> {
        let mut reporter = Reporter::new();
        split(bytes, &mut reporter).expect("a readable container");
        reporter.warnings().iter().map(|warning| warning.code).collect()
    }

    #[test]
    fn chunks_are_found() {
        let bytes = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"abcd")]);
        let parts = split(&bytes, &mut Reporter::new()).expect("valid");
        assert_eq!(parts.json, b"{}  ", "the JSON chunk");
        assert_eq!(parts.binary, Some(&b"abcd"[..]), "the binary chunk");
        assert_eq!(codes(&bytes), [""; 0], "nothing to complain about");
    }

    #[test]
    fn oddities_are_warnings() {
        let mut bytes = glb(&[(b"JSON", b"{}")]);
        bytes.push(0);
        assert_eq!(codes(&bytes), ["trailing_bytes", "chunk_not_aligned"], "both are harmless");
        assert_eq!(codes(&glb(&[(b"JSON", b"{}  "), (b"ABCD", b"")])), ["unknown_chunk"], "left out");
        assert_eq!(codes(b"\xef\xbb\xbf{}"), ["byte_order_mark"], "skipped");
    }

    #[test]
    fn every_cut_is_an_error() {
        let bytes = glb(&[(b"JSON", b"{}  "), (b"BIN\0", b"abcd")]);
        for length in 4..bytes.len() {
            assert!(split(&bytes[..length], &mut Reporter::new()).is_err(), "cut at {length}");
        }
        assert!(split(&glb(&[(b"BIN\0", b"abcd")]), &mut Reporter::new()).is_err(), "no JSON first");
        let mut old = glb(&[(b"JSON", b"{}  ")]);
        old[4] = 1;
        assert!(split(&old, &mut Reporter::new()).is_err(), "version 1");
    }
}
