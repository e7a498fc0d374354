//! The parsed file: its JSON, its buffers, its buffer views. Resolves every URI, and opens none.

use base64::{
    DecodeError, Engine as _,
    engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig},
};
use serde_json::Value;

use super::{MESHOPT_EXTENSIONS, container::Parts, json::Cursor};
use crate::{
    formats::{Budget, FormatError, Limit},
    model::Reporter,
};

const PHASE: &str = "buffers";

/// A glTF file in memory. Also what a scene keeps as its payload, to be written back.
#[derive(Debug)]
pub(super) struct Document {
    /// The JSON; the URIs of buffers that were embedded have been taken out.
    pub(super) json: Value,
    /// One for each of `buffers`.
    pub(super) buffers: Vec<Buffer>,
    /// One for each of `bufferViews`.
    pub(super) views: Vec<View>,
}

/// The content of a buffer.
#[derive(Debug)]
pub(super) struct Buffer {
    /// Its declared length.
    pub(super) length: usize,
    /// Its bytes, as many as `length`; nothing for buffers that only stand for decompressed data, or whose content is not
    /// in the file.
    pub(super) bytes: Option<Vec<u8>>,
}

/// A slice of a buffer, checked to be inside of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct View {
    /// Index of the buffer.
    pub(super) buffer: usize,
    /// First byte.
    pub(super) offset: usize,
    /// Number of bytes.
    pub(super) length: usize,
    /// Bytes from one element to the next, where that is not the element's size.
    pub(super) stride: Option<usize>,
    /// Where the compressed form of the same bytes is.
    pub(super) compressed: Option<CompressedView>,
}

/// The compressed form of a view.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct CompressedView {
    /// Index of the buffer.
    pub(super) buffer: usize,
    /// First byte.
    pub(super) offset: usize,
    /// Number of compressed bytes.
    pub(super) length: usize,
    /// Bytes of one decoded element.
    pub(super) stride: usize,
    /// Number of decoded elements.
    pub(super) count: usize,
    /// What was compressed, such as `ATTRIBUTES`.
    pub(super) mode: String,
    /// What is done after decoding, such as `QUATERNION`.
    pub(super) filter: Option<String>,
}

impl Document {
    /// Takes the parsed JSON and the binary chunk.
    pub(super) fn new(
        mut json: Value,
        parts: &Parts<'_>,
        budget: &mut Budget<'_>,
        reporter: &mut Reporter,
    ) -> Result<Self, FormatError> {
        check_asset(&Cursor::root(&json))?;
        let buffers = read_buffers(&Cursor::root(&json), parts.binary, budget, reporter)?;
        if let Some(objects) = json.get_mut("buffers").and_then(Value::as_array_mut) {
            // The bytes are held once, not twice; the writer makes a new URI where one is needed.
            objects.iter_mut().filter_map(Value::as_object_mut).for_each(|object| {
                object.shift_remove("uri");
            });
        }
        let views = read_views(&Cursor::root(&json), &buffers)?;
        Ok(Self { json, buffers, views })
    }

    /// The whole JSON.
    pub(super) const fn root(&self) -> Cursor<'_, '_> {
        Cursor::root(&self.json)
    }
}

fn check_asset(root: &Cursor<'_, '_>) -> Result<(), FormatError> {
    let asset = root.require("asset")?;
    let version = asset.require("version")?;
    let needed = asset.get("minVersion")?.unwrap_or(version);
    for version in [version, needed] {
        let text = version.text()?;
        let parsed = text
            .split_once('.')
            .and_then(|(major, minor)| Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?)));
        let Some((major, minor)) = parsed else {
            return Err(version.malformed(format!("'{text}' is not a glTF version; it must be \"2.0\"")));
        };
        let needs_more = version.to_string().ends_with("minVersion") && minor > 0;
        if major != super::container::VERSION || needs_more {
            return Err(FormatError::unsupported(
                "asset",
                version.to_string(),
                format!("the file is glTF {text}; only 2.0 can be read"),
                "convert the file to glTF 2.0",
            ));
        }
    }
    Ok(())
}

fn read_buffers(
    root: &Cursor<'_, '_>,
    binary: Option<&[u8]>,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Vec<Buffer>, FormatError> {
    let mut buffers = Vec::new();
    let mut binary = binary;
    if let Some(objects) = root.get("buffers")? {
        for (index, object) in objects.elements()?.enumerate() {
            budget.check_canceled()?;
            let length = object.require("byteLength")?.size()?;
            let bytes = match object.get("uri")? {
                Some(uri) => Some(fit(embedded(&uri, budget, reporter)?, length, &object, reporter)?),
                // Only the first buffer can be the binary chunk.
                None => match binary.take_if(|_| index == 0) {
                    Some(chunk) => {
                        budget.take(Limit::DecodedBytes, chunk.len() as u64, "binary chunk")?;
                        Some(fit(chunk.to_vec(), length, &object, reporter)?)
                    }
                    None => None,
                },
            };
            buffers.push(Buffer { length, bytes });
        }
    }
    if let Some(chunk) = binary.filter(|chunk| !chunk.is_empty()) {
        let detail = format!("no buffer refers to the binary chunk of {} bytes; it was left out", chunk.len());
        reporter.warn("binary_chunk_unused", "/buffers", detail, "");
    }
    Ok(buffers)
}

/// Makes a buffer exactly as long as declared. Up to three bytes of padding are normal.
fn fit(
    mut bytes: Vec<u8>,
    length: usize,
    object: &Cursor<'_, '_>,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    if bytes.len() < length {
        return Err(object.malformed(format!("the buffer declares {length} bytes and has {}", bytes.len())));
    }
    if bytes.len() - length > 3 {
        let detail = format!("the buffer declares {length} bytes and has {}; the rest was left out", bytes.len());
        reporter.warn("buffer_too_long", object.to_string(), detail, "");
    }
    bytes.truncate(length);
    Ok(bytes)
}

fn embedded(uri: &Cursor<'_, '_>, budget: &mut Budget<'_>, reporter: &mut Reporter) -> Result<Vec<u8>, FormatError> {
    let text = uri.text()?;
    if strip_prefix_ignoring_case(text, "data:").is_none() {
        return Err(FormatError::unsupported(
            PHASE,
            uri.to_string(),
            format!("the buffer lies in another file, '{}', which is not opened", shortened(text)),
            "send a .glb, or a .zip of the .gltf and its files",
        ));
    }
    let Some((media_type, payload)) = base64_data(text) else {
        return Err(uri.malformed("the data URI is none of base64: data:<media type>;base64,<text>"));
    };
    if !["application/octet-stream", "application/gltf-buffer"].contains(&media_type) {
        let detail = format!("a buffer has the media type '{}'; it was read as plain bytes", shortened(media_type));
        reporter.warn("unexpected_media_type", uri.to_string(), detail, "");
    }
    budget.take(Limit::DecodedBytes, (payload.len() / 4 * 3 + 3) as u64, "data URI")?;
    from_base64(payload).map_err(|error| uri.malformed(format!("the data URI is not valid base64: {error}")))
}

/// The media type and the text of a data URI that has its bytes as base64.
pub(super) fn base64_data(uri: &str) -> Option<(&str, &str)> {
    let (media_type, payload) = strip_prefix_ignoring_case(uri, "data:")?.split_once(',')?;
    Some((strip_suffix_ignoring_case(media_type, ";base64")?, payload))
}

/// The bytes of base64 text, padded or not.
pub(super) fn from_base64(text: &str) -> Result<Vec<u8>, DecodeError> {
    let config = GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent);
    GeneralPurpose::new(&base64::alphabet::STANDARD, config).decode(text)
}

fn read_views(root: &Cursor<'_, '_>, buffers: &[Buffer]) -> Result<Vec<View>, FormatError> {
    let mut views = Vec::new();
    let Some(objects) = root.get("bufferViews")? else { return Ok(views) };
    for object in objects.elements()? {
        let buffer = object.require("buffer")?.index(buffers.len(), "buffers")?;
        let (offset, length) = read_range(&object, &buffers[buffer])?;
        let stride = object.get("byteStride")?.map(|stride| stride.size()).transpose()?;
        if let Some(stride) = stride.filter(|stride| !(4..=252).contains(stride) || !stride.is_multiple_of(4)) {
            let detail = format!("a stride of {stride} is not a multiple of four from 4 to 252");
            return Err(object.require("byteStride")?.malformed(detail));
        }
        views.push(View { buffer, offset, length, stride, compressed: read_compressed(&object, buffers)? });
    }
    Ok(views)
}

fn read_compressed(object: &Cursor<'_, '_>, buffers: &[Buffer]) -> Result<Option<CompressedView>, FormatError> {
    let Some(extensions) = object.get("extensions")? else { return Ok(None) };
    for name in MESHOPT_EXTENSIONS {
        let Some(extension) = extensions.get(name)? else { continue };
        let buffer = extension.require("buffer")?.index(buffers.len(), "buffers")?;
        let (offset, length) = read_range(&extension, &buffers[buffer])?;
        return Ok(Some(CompressedView {
            buffer,
            offset,
            length,
            stride: extension.require("byteStride")?.size()?,
            count: extension.require("count")?.size()?,
            mode: extension.require("mode")?.text()?.to_owned(),
            filter: extension.get("filter")?.map(|filter| filter.text().map(str::to_owned)).transpose()?,
        }));
    }
    Ok(None)
}

fn read_range(object: &Cursor<'_, '_>, buffer: &Buffer) -> Result<(usize, usize), FormatError> {
    let offset = object.get("byteOffset")?.map_or(Ok(0), |offset| offset.size())?;
    let length = object.require("byteLength")?.size()?;
    match offset.checked_add(length) {
        Some(end) if end <= buffer.length => Ok((offset, length)),
        _ => Err(object
            .malformed(format!("{length} bytes from byte {offset} on do not fit into a buffer of {}", buffer.length))),
    }
}

/// Text from the file goes into messages; a megabyte of it does not.
fn shortened(text: &str) -> String {
    const MAX: usize = 120;
    if text.chars().nth(MAX).is_none() {
        return text.to_owned();
    }
    text.chars().take(MAX).chain(['…']).collect()
}

fn strip_prefix_ignoring_case<'a>(text: &'a str, prefix: &str) -> Option<&'a str> {
    let (head, rest) = text.split_at_checked(prefix.len())?;
    head.eq_ignore_ascii_case(prefix).then_some(rest)
}

fn strip_suffix_ignoring_case<'a>(text: &'a str, suffix: &str) -> Option<&'a str> {
    let (rest, tail) = text.split_at_checked(text.len().checked_sub(suffix.len())?)?;
    tail.eq_ignore_ascii_case(suffix).then_some(rest)
}
