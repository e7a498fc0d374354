//! Models in several files: a glTF with the buffers and images that it points to, as a zip or beside one another.
//!
//! Both become one file in which everything is embedded, which the readers then take as any other. Nothing is unpacked to
//! anywhere, and nothing is opened that was not sent along.

use std::{
    borrow::Cow,
    io::{Cursor, Read},
};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use percent_encoding::percent_decode_str;
use serde_json::Value;
use zip::ZipArchive;

use super::{
    Budget, Format, FormatError, Limit, Limits, gltf, sniff,
    zipped::{CHUNK_BYTES, check_method, check_ratio, has_more_members_than, zip_error},
};
use crate::model::Control;

const PHASE: &str = "archive";
/// An export with all its textures has a few hundred members; the directory of one with more is not even built.
const MAX_MEMBERS: usize = 4096;
/// Endings of files that a figure can be read from.
const MODELS: [&str; 6] = ["gltf", "glb", "vrm", "vrma", "fbx", "bvh"];

/// A model that was taken out of an archive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unpacked {
    /// The model's file name, without folders.
    pub name: String,
    /// The file, with everything embedded that it points to.
    pub bytes: Vec<u8>,
}

/// Takes the one model out of a zip archive; a glTF gets the buffers and images embedded that lie in the archive with it.
///
/// # Errors
/// When the archive is broken, holds no model or several, lacks a buffer of the model, or is larger than the limits allow.
pub fn unpack(bytes: &[u8], limits: &Limits, control: &Control) -> Result<Unpacked, FormatError> {
    let mut budget = Budget::new(limits, control);
    let mut archive = Archive::open(bytes, &mut budget)?;
    let model = archive.the_model()?;
    let (folder, name) = model.rsplit_once('/').unwrap_or(("", &model));
    let (folder, name) = (folder.to_owned(), name.to_owned());
    let bytes = archive.read(&model)?;
    if !name.to_ascii_lowercase().ends_with(".gltf") {
        return Ok(Unpacked { name, bytes });
    }
    let bytes = embed_with(&bytes, limits, control, |uri| {
        let path = within(&folder, uri).filter(|path| archive.holds(path));
        path.map(|path| archive.read(&path)).transpose()
    })?;
    Ok(Unpacked { name, bytes })
}

/// The format of a file's model, and its bytes: those of the file, or of the one model in an archive.
///
/// # Errors
/// As [`sniff`] and [`unpack`]; and when the model of an archive is an archive itself, which is not opened.
pub fn open<'a>(
    bytes: &'a [u8],
    name: &str,
    limits: &Limits,
    control: &Control,
) -> Result<(Format, Cow<'a, [u8]>), FormatError> {
    let format = sniff(bytes, name)?;
    if format != Format::Zip {
        return Ok((format, Cow::Borrowed(bytes)));
    }
    let Unpacked { name, bytes } = unpack(bytes, limits, control)?;
    match sniff(&bytes, &name)? {
        Format::Zip => Err(FormatError::unsupported(PHASE, name, "this is an archive in an archive", "unpack it")),
        format => Ok((format, Cow::Owned(bytes))),
    }
}

/// Embeds what a glTF document points to. `fetch` gives the content of a relative URI (percent signs decoded), or nothing where
/// there is no such file. Bytes that are no glTF JSON come back as they are: its reader explains what is wrong with them.
///
/// # Errors
/// When a buffer is not there, or the document is larger than the limits allow.
pub fn embed_with(
    document: &[u8],
    limits: &Limits,
    control: &Control,
    mut fetch: impl FnMut(&str) -> Result<Option<Vec<u8>>, FormatError>,
) -> Result<Vec<u8>, FormatError> {
    let text = document.strip_prefix(b"\xef\xbb\xbf").unwrap_or(document);
    let mut budget = Budget::new(limits, control);
    let Ok(mut json) = gltf::parse_json(text, &mut budget) else {
        return Ok(document.to_owned());
    };
    let mut changed = false;
    for (list, is_buffer) in [("buffers", true), ("images", false)] {
        let Some(entries) = json.get_mut(list).and_then(Value::as_array_mut) else { continue };
        for (index, entry) in entries.iter_mut().enumerate() {
            let Some(uri) = entry.get("uri").and_then(Value::as_str).filter(|uri| is_relative(uri)) else { continue };
            let path = percent_decoded(uri);
            let Some(content) = fetch(&path)? else {
                if !is_buffer {
                    // The output goes on referring to it, and a warning says so.
                    continue;
                }
                let shown: String = path.chars().take(200).collect();
                return Err(FormatError::malformed(
                    PHASE,
                    format!("/buffers/{index}/uri"),
                    format!("the buffer is in '{shown}', which does not exist"),
                )
                .with_hint("send the file along, in one zip with the .gltf, or send a .glb"));
            };
            // Once in the document, and once in the text that is made of it.
            budget.take_array(content.len() as u64 / 3 * 4 + 4, 2, list)?;
            let media_type = if is_buffer { "application/octet-stream" } else { media_type(entry, &path) };
            let embedded = format!("data:{media_type};base64,{}", STANDARD.encode(content));
            entry["uri"] = Value::String(embedded);
            changed = true;
        }
    }
    if !changed {
        return Ok(document.to_owned());
    }
    serde_json::to_vec(&json).map_err(|error| FormatError::malformed(PHASE, "", error.to_string()))
}

/// Whether a file of this name may point to others.
#[must_use]
pub fn may_point_to_others(bytes: &[u8], name: &str) -> bool {
    sniff(bytes, name) == Ok(Format::Gltf)
}

fn media_type(image: &Value, path: &str) -> &'static str {
    let declared = image.get("mimeType").and_then(Value::as_str).unwrap_or_default();
    let ending = path.rsplit('.').next().unwrap_or_default().to_ascii_lowercase();
    match (declared, ending.as_str()) {
        ("image/jpeg", _) | ("", "jpg" | "jpeg") => "image/jpeg",
        ("image/webp", _) | ("", "webp") => "image/webp",
        ("image/ktx2", _) | ("", "ktx2") => "image/ktx2",
        _ => "image/png",
    }
}

fn is_relative(uri: &str) -> bool {
    let scheme = uri.split(['/', '?', '#']).next().unwrap_or_default();
    !uri.is_empty() && !scheme.contains(':') && !uri.starts_with('/')
}

/// `a%20b` as `a b`. What is no escape stays as it is.
fn percent_decoded(uri: &str) -> String {
    percent_decode_str(uri).decode_utf8().map_or_else(|_| uri.to_owned(), Cow::into_owned)
}

/// The path of a relative URI inside the archive; nothing where it climbs out.
fn within(folder: &str, uri: &str) -> Option<String> {
    let mut parts: Vec<&str> = folder.split('/').filter(|part| !part.is_empty()).collect();
    for part in uri.split(['/', '\\']) {
        match part {
            "" | "." => {}
            ".." => {
                parts.pop()?;
            }
            part => parts.push(part),
        }
    }
    Some(parts.join("/"))
}

/// A zip archive whose members are paid for before they are read.
pub(super) struct Archive<'bytes, 'budget, 'limits> {
    zip: ZipArchive<Cursor<&'bytes [u8]>>,
    /// Name as the archive has it, with slashes the right way round.
    pub(super) names: Vec<String>,
    archive_bytes: u64,
    unpacked_bytes: u64,
    budget: &'budget mut Budget<'limits>,
}

impl<'bytes, 'budget, 'limits> Archive<'bytes, 'budget, 'limits> {
    pub(super) fn open(bytes: &'bytes [u8], budget: &'budget mut Budget<'limits>) -> Result<Self, FormatError> {
        budget.take(Limit::FileBytes, bytes.len() as u64, "file")?;
        if has_more_members_than(MAX_MEMBERS, bytes) {
            let detail = format!("the archive has more than {MAX_MEMBERS} members");
            return Err(refused("archive", detail));
        }
        let zip = ZipArchive::new(Cursor::new(bytes)).map_err(|error| packed(&error, "archive"))?;
        let names = zip.file_names_raw().map(|name| String::from_utf8_lossy(name).replace('\\', "/")).collect();
        Ok(Self { zip, names, archive_bytes: bytes.len() as u64, unpacked_bytes: 0, budget })
    }

    fn holds(&self, path: &str) -> bool {
        self.index(path).is_some()
    }

    fn index(&self, path: &str) -> Option<usize> {
        let exact = self.names.iter().position(|name| name == path);
        // Exports from systems that do not mind the case of names.
        exact.or_else(|| self.names.iter().position(|name| name.eq_ignore_ascii_case(path)))
    }

    fn the_model(&self) -> Result<String, FormatError> {
        let is_hidden = |name: &str| name.split('/').any(|part| part.starts_with('.') || part == "__MACOSX");
        let is_model = |name: &str| {
            let ending = name.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
            ending.is_some_and(|ending| MODELS.contains(&ending.as_str()))
        };
        let models: Vec<&String> = self.names.iter().filter(|name| is_model(name) && !is_hidden(name)).collect();
        let shown = |names: &[&String]| {
            let few: Vec<String> = names.iter().take(6).map(|name| format!("'{}'", name.escape_debug())).collect();
            few.join(", ")
        };
        match models.as_slice() {
            [model] => Ok((*model).clone()),
            [] => {
                let all: Vec<&String> = self.names.iter().collect();
                let detail = format!("the archive holds no model, only {}", shown(&all));
                Err(refused("archive", detail).with_hint(format!("put one file of .{} into it", MODELS.join(", ."))))
            }
            several => {
                let detail = format!("the archive holds {} models: {}", several.len(), shown(several));
                Err(refused("archive", detail).with_hint("put one model with its own files into each archive"))
            }
        }
    }

    pub(super) fn read(&mut self, path: &str) -> Result<Vec<u8>, FormatError> {
        let index = self.index(path).ok_or_else(|| refused(path, "it is not in the archive"))?;
        let member = self.zip.by_index(index).map_err(|error| packed(&error, path))?;
        check_method(&member, path)?;
        let declared = member.size();
        self.budget.take(Limit::DecodedBytes, declared, path)?;
        self.unpacked_bytes += declared;
        check_ratio(self.unpacked_bytes, self.archive_bytes, self.budget, path)?;
        // One byte more than declared shows a member that lies; the checksum is compared at the end.
        let mut content = Vec::new();
        let mut member = member.take(declared + 1);
        loop {
            self.budget.check_canceled()?;
            let chunk = (&mut member).take(CHUNK_BYTES as u64).read_to_end(&mut content);
            if chunk.map_err(|error| refused(path, format!("the member cannot be unpacked: {error}")))? == 0 {
                break;
            }
        }
        if content.len() as u64 != declared {
            return Err(refused(path, format!("the member declares {declared} bytes and has {}", content.len())));
        }
        Ok(content)
    }
}

fn packed(error: &zip::result::ZipError, place: &str) -> FormatError {
    zip_error(error, place).with_hint("pack it again as a plain zip, without a password")
}

fn refused(place: &str, detail: impl Into<String>) -> FormatError {
    FormatError::malformed(PHASE, place, detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_stay_in_the_archive() {
        assert_eq!(within("a/b", "../c.bin").as_deref(), Some("a/c.bin"), "up and down again");
        assert_eq!(within("", "./x/./y.bin").as_deref(), Some("x/y.bin"), "here");
        assert_eq!(within("a", "../../c.bin"), None, "not out");
        assert_eq!(percent_decoded("a%20b%"), "a b%", "escapes, and what is none");
        assert!(is_relative("a b.bin") && is_relative("x/a:b.bin"), "names");
        assert!(!is_relative("https://x/y.bin") && !is_relative("data:,") && !is_relative("/etc/passwd"), "no names");
    }

    #[test]
    fn a_document_that_points_nowhere_is_left_alone() {
        let never = |_: &str| -> Result<Option<Vec<u8>>, FormatError> { panic!("nothing to fetch") };
        for document in [&b"{\"asset\": {\"version\": \"2.0\"}}"[..], b"{broken", b"{\"buffers\": 7}"] {
            let same = embed_with(document, &Limits::default(), &Control::new(), never).expect("nothing to do");
            assert_eq!(same, document, "byte for byte");
        }
    }
}
