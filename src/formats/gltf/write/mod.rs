//! A scene and a clip to a file: the target's own document with one more animation, or a new document with the skeleton.

mod animation;
mod carried;
mod display;
mod edit;
mod images;
mod meshes;
mod pack;
mod schema;
mod sections;
mod skeleton;
mod skins;
mod streams;
mod vrma;

pub(in crate::formats) use display::write_display;
pub(in crate::formats) use pack::contain;
pub(in crate::formats) use sections::{FRAMES_OF_DOCUMENT, GlbSectionWriter};

use std::{borrow::Cow, collections::BTreeMap};

use serde::Serialize;
use serde_json::{Map, Value};

use super::document::Document;
use crate::{
    formats::{Compression, Format, FormatError, Include, WriteOptions, written},
    model::{Clip, ClipError, Control, Reporter, Scene},
};
use schema::{Accessor, BufferView, List, Target};
use skeleton::Content;

/// Where every piece of the buffer begins: floats and the data of compressed views need four.
const ALIGNMENT: usize = 4;

/// A document whose buffers are one run of bytes.
#[derive(Debug)]
struct Output<'a> {
    json: Map<String, Value>,
    binary: Binary<'a>,
    /// How the animation is stored.
    compression: Compression,
    /// Index of the buffer that compressed animation decodes into, behind all that have content or stand for that of others.
    decoded_buffer: usize,
    /// Its length; 0 where nothing is compressed, and then there is no such buffer.
    decoded_length: usize,
}

impl<'a> Output<'a> {
    /// A document of which no buffer but the first is known.
    fn new(json: Map<String, Value>, compression: Compression) -> Self {
        Self { json, binary: Binary::default(), compression, decoded_buffer: 1, decoded_length: 0 }
    }

    /// Adds bytes and a view of them; `purpose` is the view's target, where it has one. Gives the index of the view.
    fn add_view(&mut self, bytes: Cow<'a, [u8]>, purpose: Option<Target>) -> Result<usize, FormatError> {
        let byte_length = bytes.len();
        let byte_offset = self.binary.push(bytes);
        let view = BufferView { buffer: 0, byte_offset, byte_length, target: purpose, extensions: BTreeMap::new() };
        self.push(List::BufferViews, &view)
    }

    /// Adds values and a view of them, as [`Self::add_view`].
    fn add_values<T: bytemuck::Pod>(&mut self, values: &[T], purpose: Option<Target>) -> Result<usize, FormatError> {
        self.add_view(Cow::Owned(bytemuck::cast_slice(values).to_vec()), purpose)
    }

    /// Adds an accessor. Gives its index.
    fn add_accessor(&mut self, accessor: &Accessor) -> Result<usize, FormatError> {
        self.push(List::Accessors, accessor)
    }

    /// Adds an object to a list of the document. Gives its index.
    fn push(&mut self, list: List, object: &impl Serialize) -> Result<usize, FormatError> {
        let object = to_value(object)?;
        let objects = array(&mut self.json, list.name())?;
        objects.push(object);
        Ok(objects.len() - 1)
    }
}

/// The bytes of the one buffer of an output, as pieces that are copied once, at the end.
#[derive(Debug, Default)]
struct Binary<'a> {
    pieces: Vec<Cow<'a, [u8]>>,
    length: usize,
}

impl<'a> Binary<'a> {
    /// Adds a piece and says at which byte it begins.
    fn push(&mut self, piece: Cow<'a, [u8]>) -> usize {
        let offset = self.length.next_multiple_of(ALIGNMENT);
        let padding = offset - self.length;
        if padding > 0 {
            self.pieces.push(Cow::Borrowed(&[0; ALIGNMENT][..padding]));
        }
        self.length = offset + piece.len();
        self.pieces.push(piece);
        offset
    }

    /// Number of bytes, without padding at the end.
    const fn length(&self) -> usize {
        self.length
    }

    /// The pieces in order, padding included.
    fn pieces(&self) -> impl Iterator<Item = &[u8]> {
        self.pieces.iter().map(Cow::as_ref)
    }
}

/// Encodes the clip as the first animation of the target.
///
/// A target that came from glTF keeps everything that it had, with all buffers merged into one; accessors of animations
/// that are dropped stay in place without use. Any other target, and [`Include::SkeletonAndAnimation`], give a new
/// document with nodes, one skin per tree of joints, and the animation; and of a target that came from FBX its meshes as triangles,
/// with plain materials. The target must be in +Y up, +Z front and meters. Nodes of `posed` joints are written as the target's skeleton
/// has them, and not as its document does.
///
/// # Errors
/// When the clip is not of the target's skeleton, when a VRM is asked for and the target is none, when the output would be
/// larger than a GLB can be; or when the work is canceled.
pub(in crate::formats) fn write(
    target: &Scene,
    posed: &[usize],
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    if clip.joints().len() != target.skeleton.len() {
        let (tracks, joints) = (clip.joints().len(), target.skeleton.len());
        let detail = format!("the clip has tracks for {tracks} joints, but the target has {joints}");
        return Err(
            FormatError::malformed("write", "", detail).with_hint("write the clip onto the rig it was made for")
        );
    }
    if let Some(stretched) = &target.stretched {
        let malformed = |error: ClipError| FormatError::malformed("write", "", error.to_string());
        let kept = written::kept_clips(target, options).map(|clip| stretched.clip_of_nodes(&target.skeleton, clip));
        let nodes = Scene {
            clips: kept.collect::<Result<_, _>>().map_err(malformed)?,
            skeleton: stretched.skeleton_of_nodes(&target.skeleton),
            skins: target.skins.clone(),
            payload: target.payload.clone(),
            ..Scene::default()
        };
        let clip = stretched.clip_of_nodes(&target.skeleton, clip);
        let clip = clip.map_err(malformed)?;
        let posed = stretched.posed_below(&target.skeleton, posed);
        return write(&nodes, &posed, &clip, options, control, reporter);
    }
    if options.format == Format::Vrma {
        return vrma::write(target, clip, options, control, reporter);
    }
    let document = target.payload.get::<Document>().filter(|_| options.include == Include::Everything);
    if options.format == Format::Vrm && !document.is_some_and(is_vrm) {
        return Err(FormatError::unsupported(
            "write",
            "",
            "a .vrm can only be written from a VRM target, with everything in it",
            "ask for .glb, or send a VRM as the target",
        ));
    }
    let output = match document {
        Some(document) => {
            let mut output = edit::edit(document, target, clip, options, control, reporter)?;
            edit::pose_nodes(&mut output.json, target, posed);
            output
        }
        None => {
            let meshes = match options.include {
                Include::Everything => written::meshes(target, control, reporter)?,
                Include::SkeletonAndAnimation => None,
            };
            let content = meshes.map_or(Content::Skins, Content::Meshes);
            skeleton::build(
                target,
                (clip, written::kept_clips(target, options)),
                content,
                options.compression,
                control,
                reporter,
            )?
        }
    };
    finish(output, options, control, reporter)
}

/// Notes in a document what it was made from, and makes a file of it.
fn finish(
    mut output: Output<'_>,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    if let Some(extras) = &options.extras {
        merge_extras(&mut output.json, extras, reporter);
    }
    control.check()?;
    match options.format {
        Format::Gltf => pack::gltf(output),
        Format::Zip => pack::zip(output),
        _ => pack::glb(output),
    }
}

fn is_vrm(document: &Document) -> bool {
    let extensions = document.json.get("extensions");
    extensions.is_some_and(|extensions| extensions.get("VRM").is_some() || extensions.get("VRMC_vrm").is_some())
}

/// Provenance goes to `asset.extras.retargetd`, beside whatever is there.
fn merge_extras(json: &mut Map<String, Value>, extras: &Value, reporter: &mut Reporter) {
    let asset = json.get_mut("asset").and_then(Value::as_object_mut);
    let place = asset.map(|asset| asset.entry("extras").or_insert_with(|| Value::Object(Map::new())));
    let Some(Value::Object(place)) = place else {
        let detail =
            "the document's asset.extras is not an object; what the output was made from could not be noted in it";
        reporter.warn("extras_not_merged", "/asset/extras", detail, "");
        return;
    };
    match (place.get_mut("retargetd"), extras) {
        (Some(Value::Object(present)), Value::Object(new)) => {
            present.extend(new.iter().map(|(key, value)| (key.clone(), value.clone())));
        }
        _ => {
            place.insert("retargetd".into(), extras.clone());
        }
    }
}

/// An object as the document has it.
fn to_value(object: &impl Serialize) -> Result<Value, FormatError> {
    serde_json::to_value(object)
        .map_err(|error| FormatError::malformed("write", "", format!("the document cannot be written: {error}")))
}

/// The array of that name, made where it is not there.
fn array<'j>(json: &'j mut Map<String, Value>, key: &str) -> Result<&'j mut Vec<Value>, FormatError> {
    let value = json.entry(key).or_insert_with(|| Value::Array(Vec::new()));
    value.as_array_mut().ok_or_else(|| FormatError::malformed("write", format!("/{key}"), "this must be an array"))
}
