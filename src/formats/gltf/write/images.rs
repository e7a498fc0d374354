//! Images that a document has as base64 text, as bytes of a GLB: a third smaller, and where readers of a GLB look for them.

use std::borrow::Cow;

use serde_json::{Map, Value};

use super::Output;
use crate::formats::{
    FormatError,
    gltf::document::{base64_data, from_base64},
};

/// Moves the images of data URIs into views of the buffer. What cannot be decoded, or is of no kind, stays as it is.
///
/// # Errors
/// When the list of views is none.
pub(super) fn to_bytes(output: &mut Output<'_>) -> Result<(), FormatError> {
    let Some(Value::Array(images)) = output.json.get_mut("images") else { return Ok(()) };
    let mut images = std::mem::take(images);
    for image in images.iter_mut().filter_map(Value::as_object_mut) {
        let Some((media_type, bytes)) = content(image) else { continue };
        let view = output.add_view(Cow::Owned(bytes), None)?;
        image.shift_remove("uri");
        image.insert("mimeType".into(), media_type.into());
        image.insert("bufferView".into(), view.into());
    }
    output.json.insert("images".into(), Value::Array(images));
    Ok(())
}

/// The media type and the bytes of an image of a data URI.
fn content(image: &Map<String, Value>) -> Option<(String, Vec<u8>)> {
    let (media_type, payload) = base64_data(image.get("uri")?.as_str()?)?;
    let declared = image.get("mimeType").and_then(Value::as_str);
    let media_type = declared.unwrap_or(media_type);
    let bytes = from_base64(payload).ok().filter(|bytes| !bytes.is_empty())?;
    media_type.starts_with("image/").then(|| (media_type.to_owned(), bytes))
}
