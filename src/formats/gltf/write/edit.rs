//! The target's own document with one more animation. What is not understood stays as it is, number for number.

use std::borrow::Cow;

use serde_json::{Map, Value, json};

use super::{Binary, Output, animation, array, images, skeleton::rotation, streams::decoded_buffer, to_value};
use crate::{
    formats::{
        Format, FormatError, TargetClips, WriteOptions,
        gltf::{
            MESHOPT_EXTENSIONS,
            document::{Buffer, Document, View},
        },
    },
    model::{Clip, Control, Reporter, Scene, Transform},
};

/// Where the content of a buffer went.
#[derive(Clone, Copy, Debug)]
struct Moved {
    buffer: usize,
    shift: usize,
}

/// Copies the document, merges its buffers, puts the clip first.
pub(super) fn edit<'a>(
    document: &'a Document,
    target: &Scene,
    clip: &'a Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Output<'a>, FormatError> {
    let json = document.json.as_object().cloned().unwrap_or_default();
    let mut output = Output::new(json, options.compression);
    let will_have_bytes = !target.skeleton.is_empty() || document.buffers.iter().any(|buffer| buffer.bytes.is_some());
    let moved = merge_buffers(document, &mut output.binary, will_have_bytes);
    output.decoded_buffer = 1 + document.buffers.iter().filter(|buffer| buffer.bytes.is_none()).count();
    move_views(&mut output.json, &document.views, &moved)?;
    control.check()?;

    let new = animation::append(
        &mut output,
        target,
        clip,
        |_, joint| joint.node,
        &animation::morph_nodes(target),
        control,
        reporter,
    )?;
    let old = match output.json.get_mut("animations").and_then(Value::as_array_mut) {
        Some(animations) => std::mem::take(animations),
        None => Vec::new(),
    };
    let had_clips = !old.is_empty();
    let mut animations: Vec<Value> = new.into_iter().collect();
    let replaced = options.replaced_clip.filter(|_| !animations.is_empty());
    let places = Places { first: animations.len(), replaced };
    if options.target_clips == TargetClips::Keep {
        let is_kept = |(index, _): &(usize, Value)| replaced != Some(*index);
        animations.extend(old.into_iter().enumerate().filter(is_kept).map(|(_, animation)| animation));
    }
    if animations.is_empty() {
        output.json.shift_remove("animations");
    } else {
        output.json.insert("animations".into(), Value::Array(animations));
    }
    if had_clips {
        follow_animations(&mut output.json, &places, options.target_clips, reporter);
    }

    split_animated_matrices(&mut output.json, target, clip);
    if will_have_bytes && matches!(options.format, Format::Glb | Format::Vrm) {
        images::to_bytes(&mut output)?;
    }
    list_buffers(&mut output, document, will_have_bytes)?;
    warn_of_external_images(&output.json, reporter);
    Ok(output)
}

/// Buffers with content become one; the others keep their order behind it.
fn merge_buffers<'a>(document: &'a Document, binary: &mut Binary<'a>, will_have_bytes: bool) -> Vec<Moved> {
    let mut next_without_bytes = usize::from(will_have_bytes);
    let mut place = |buffer: &'a Buffer| match &buffer.bytes {
        Some(bytes) => Moved { buffer: 0, shift: binary.push(Cow::Borrowed(bytes)) },
        None => {
            let buffer = next_without_bytes;
            next_without_bytes += 1;
            Moved { buffer, shift: 0 }
        }
    };
    document.buffers.iter().map(&mut place).collect()
}

fn move_views(json: &mut Map<String, Value>, views: &[View], moved: &[Moved]) -> Result<(), FormatError> {
    if views.is_empty() {
        return Ok(());
    }
    for (object, view) in array(json, "bufferViews")?.iter_mut().zip(views) {
        move_range(object, view.buffer, view.offset, moved);
        let Some(compressed) = &view.compressed else { continue };
        // The reader took the first of the two names that is there; a second one is moved by its own numbers.
        for name in MESHOPT_EXTENSIONS {
            let Some(extension) = object.get_mut("extensions").and_then(|extensions| extensions.get_mut(name)) else {
                continue;
            };
            let number = |key: &str| extension.get(key).and_then(Value::as_u64).and_then(|at| usize::try_from(at).ok());
            let buffer = number("buffer").filter(|buffer| *buffer < moved.len()).unwrap_or(compressed.buffer);
            let offset = number("byteOffset").unwrap_or(0);
            move_range(extension, buffer, offset, moved);
        }
    }
    Ok(())
}

/// Writes only the numbers that change.
fn move_range(object: &mut Value, buffer: usize, offset: usize, moved: &[Moved]) {
    let to = moved[buffer];
    if to.buffer != buffer {
        object["buffer"] = json!(to.buffer);
    }
    if to.shift != 0 {
        object["byteOffset"] = json!(offset + to.shift);
    }
}

/// The merged buffer first, then those without content.
fn list_buffers(output: &mut Output<'_>, document: &Document, will_have_bytes: bool) -> Result<(), FormatError> {
    let objects = match output.json.get_mut("buffers").and_then(Value::as_array_mut) {
        Some(objects) => std::mem::take(objects),
        None => Vec::new(),
    };
    let (with_bytes, without_bytes): (Vec<_>, Vec<_>) =
        objects.into_iter().zip(&document.buffers).partition(|(_, buffer)| buffer.bytes.is_some());
    let mut buffers = Vec::new();
    if will_have_bytes {
        let mut merged = with_bytes.into_iter().next().map_or_else(|| json!({}), |(object, _)| object);
        merged["byteLength"] = json!(output.binary.length());
        buffers.push(merged);
    }
    buffers.extend(without_bytes.into_iter().map(|(object, _)| object));
    if output.decoded_length > 0 {
        buffers.push(to_value(&decoded_buffer(output.decoded_length))?);
    }
    if !buffers.is_empty() {
        *array(&mut output.json, "buffers")? = buffers;
    }
    Ok(())
}

/// Gives the nodes of these joints the transforms of the skeleton.
pub(super) fn pose_nodes(json: &mut Map<String, Value>, target: &Scene, joints: &[usize]) {
    let Some(nodes) = json.get_mut("nodes").and_then(Value::as_array_mut) else { return };
    for joint in joints.iter().filter_map(|joint| target.skeleton.joints().get(*joint)) {
        let Some(node) = nodes.get_mut(joint.node).and_then(Value::as_object_mut) else { continue };
        node.shift_remove("matrix");
        node.insert("translation".into(), json!(joint.rest.translation.to_array()));
        node.insert("rotation".into(), json!(rotation(joint.rest.rotation)));
        node.insert("scale".into(), json!(joint.rest.scale.to_array()));
    }
}

/// A node with a matrix cannot be animated; those that are get the equal translation, rotation and scale.
fn split_animated_matrices(json: &mut Map<String, Value>, target: &Scene, clip: &Clip) {
    let Some(nodes) = json.get_mut("nodes").and_then(Value::as_array_mut) else { return };
    for (joint, tracks) in target.skeleton.joints().iter().zip(clip.joints()) {
        let is_animated =
            tracks.translation.is_animated() || tracks.rotation.is_animated() || tracks.scale.is_animated();
        let Some(node) = nodes.get_mut(joint.node).and_then(Value::as_object_mut).filter(|_| is_animated) else {
            continue;
        };
        if node.shift_remove("matrix").is_some() {
            let Transform { translation, rotation, scale } = joint.rest;
            node.insert("translation".into(), json!(translation.to_array()));
            node.insert("rotation".into(), json!(rotation.to_array()));
            node.insert("scale".into(), json!(scale.to_array()));
        }
    }
}

/// Where the animations of a document went.
struct Places {
    /// The first of them that was kept is behind so many new ones.
    first: usize,
    /// The one whose place a new one took.
    replaced: Option<usize>,
}

impl Places {
    /// The index of an animation that had another one.
    fn now(&self, index: usize) -> usize {
        match self.replaced {
            Some(replaced) if index == replaced => 0,
            Some(replaced) if index > replaced => (index - 1).saturating_add(self.first),
            _ => index.saturating_add(self.first),
        }
    }
}

/// Moves what refers to animations by index: the `loop-animation` component of Hubs, and pointers to animations. Behavior
/// graphs have them as plain numbers that cannot be told from others.
fn follow_animations(json: &mut Map<String, Value>, places: &Places, clips: TargetClips, reporter: &mut Reporter) {
    let uses = |name: &str| {
        let used = json.get("extensionsUsed").and_then(Value::as_array);
        used.is_some_and(|used| used.iter().any(|entry| entry.as_str() == Some(name)))
    };
    let uses_components = uses("MOZ_hubs_components");
    if uses("KHR_interactivity") || (uses_components && clips == TargetClips::Drop) {
        let detail =
            "the document has behaviors that refer to its animations by number; they may start another one now";
        reporter.warn("animation_references", "/extensions", detail, "check the behaviors of the output");
    }
    if clips == TargetClips::Drop {
        return;
    }
    for node in json.get_mut("nodes").and_then(Value::as_array_mut).into_iter().flatten().filter(|_| uses_components) {
        let indices = node.pointer_mut("/extensions/MOZ_hubs_components/loop-animation/activeClipIndices");
        for index in indices.and_then(Value::as_array_mut).into_iter().flatten() {
            if let Some(old) = index.as_u64().and_then(|old| usize::try_from(old).ok()) {
                *index = json!(places.now(old));
            }
        }
    }
    for animation in json.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten().skip(places.first) {
        for channel in animation.get_mut("channels").and_then(Value::as_array_mut).into_iter().flatten() {
            let pointer = channel.pointer_mut("/target/extensions/KHR_animation_pointer/pointer");
            let Some(Value::String(text)) = pointer else { continue };
            let Some((index, rest)) = text.strip_prefix("/animations/").and_then(|rest| rest.split_once('/')) else {
                continue;
            };
            if let Ok(index) = index.parse::<usize>() {
                *text = format!("/animations/{}/{rest}", places.now(index));
            }
        }
    }
}

fn warn_of_external_images(json: &Map<String, Value>, reporter: &mut Reporter) {
    let images = json.get("images").and_then(Value::as_array).into_iter().flatten();
    let uris = images.enumerate().filter_map(|(index, image)| Some((index, image.get("uri")?.as_str()?)));
    for (index, uri) in uris.filter(|(_, uri)| !uri.get(..5).is_some_and(|head| head.eq_ignore_ascii_case("data:"))) {
        let name: String = uri.chars().take(120).collect();
        let detail = format!("the image '{name}' lies in another file and is referred to as before");
        let hint = "put the image beside the output, or send a target with embedded images";
        reporter.warn("image_external", format!("/images/{index}/uri"), detail, hint);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_follow_the_animations_that_moved() {
        let now = |places: Places| [0, 1, 2].map(|index| places.now(index));
        assert_eq!(now(Places { first: 1, replaced: None }), [1, 2, 3], "all are behind the new one");
        assert_eq!(now(Places { first: 1, replaced: Some(1) }), [1, 0, 2], "the new one is the second now");
        assert_eq!(now(Places { first: 0, replaced: None }), [0, 1, 2], "nothing new");
    }
}
