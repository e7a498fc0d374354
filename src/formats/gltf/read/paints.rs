//! What the surfaces of a file are painted with: the base colors of its materials, and their textures.

use glam::Vec4;
use serde_json::Value;

use crate::{
    formats::{
        Budget, FormatError,
        appearance::sane_color,
        gltf::document::{Document, base64_data, from_base64},
    },
    model::Paint,
};

/// The paints of a document, one for each of its materials.
pub(super) struct Paints {
    pub(super) paints: Vec<Paint>,
    /// Which set of texture coordinates each paint wants.
    pub(super) texture_sets: Vec<usize>,
    /// Encoded images, in the order in which paints came to them.
    pub(super) images: Vec<Vec<u8>>,
}

/// Reads all materials. What is wrong with one leaves it plain: a picture is better without a texture than not at all.
///
/// # Errors
/// When the images exceed the budget.
pub(super) fn read(document: &Document, budget: &mut Budget<'_>) -> Result<Paints, FormatError> {
    let materials = document.json.get("materials").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
    let mut found = Paints { paints: Vec::new(), texture_sets: Vec::new(), images: Vec::new() };
    let mut places: Vec<(usize, usize)> = Vec::new();
    for material in materials {
        let (mut paint, texture) = plain(material);
        found.texture_sets.push(texture.and_then(|texture| index(texture, "texCoord")).unwrap_or(0));
        if let Some(source) = texture.and_then(|texture| image_of(document, texture)) {
            let known = places.iter().find(|(image, _)| *image == source).map(|(_, place)| *place);
            paint.image = match known {
                Some(place) => Some(place),
                None => image_bytes(document, source, budget)?.map(|bytes| {
                    places.push((source, found.images.len()));
                    found.images.push(bytes);
                    found.images.len() - 1
                }),
            };
        }
        found.paints.push(paint);
    }
    Ok(found)
}

/// The paint without its image, and the reference to its texture.
fn plain(material: &Value) -> (Paint, Option<&Value>) {
    let metallic = material.get("pbrMetallicRoughness");
    let glossy = material.pointer("/extensions/KHR_materials_pbrSpecularGlossiness");
    let factor = metallic.and_then(|pbr| pbr.get("baseColorFactor"));
    let factor = factor.or_else(|| glossy.and_then(|pbr| pbr.get("diffuseFactor")));
    let texture = metallic.and_then(|pbr| pbr.get("baseColorTexture"));
    let texture = texture.or_else(|| glossy.and_then(|pbr| pbr.get("diffuseTexture")));
    let mode = material.get("alphaMode").and_then(Value::as_str);
    let cutoff = material.get("alphaCutoff").and_then(Value::as_f64).unwrap_or(0.5) as f32;
    let paint = Paint {
        base_color: factor.and_then(color).map_or(Vec4::ONE, sane_color),
        image: None,
        cut_out_below: (mode == Some("MASK")).then_some(cutoff),
        is_blended: mode == Some("BLEND"),
    };
    (paint, texture)
}

fn color(value: &Value) -> Option<Vec4> {
    let parts: Vec<f32> = value.as_array()?.iter().filter_map(Value::as_f64).map(|part| part as f32).collect();
    <[f32; 4]>::try_from(parts).ok().map(Vec4::from_array)
}

fn index(object: &Value, key: &str) -> Option<usize> {
    object.get(key)?.as_u64().and_then(|index| usize::try_from(index).ok())
}

fn image_of(document: &Document, texture: &Value) -> Option<usize> {
    let texture = document.json.get("textures")?.get(index(texture, "index")?)?;
    index(texture, "source").or_else(|| index(texture.pointer("/extensions/EXT_texture_webp")?, "source"))
}

fn image_bytes(document: &Document, image: usize, budget: &mut Budget<'_>) -> Result<Option<Vec<u8>>, FormatError> {
    let Some(entry) = document.json.get("images").and_then(|images| images.get(image)) else { return Ok(None) };
    let place = format!("/images/{image}");
    if let Some(view) = index(entry, "bufferView").and_then(|view| document.views.get(view)) {
        let bytes = document.buffers[view.buffer].bytes.as_ref();
        let Some(bytes) = bytes.and_then(|bytes| bytes.get(view.offset..view.offset + view.length)) else {
            return Ok(None);
        };
        budget.take_array(bytes.len() as u64, 1, &place)?;
        return Ok(Some(bytes.to_vec()));
    }
    let Some((_, payload)) = entry.get("uri").and_then(Value::as_str).and_then(base64_data) else { return Ok(None) };
    budget.take_array(payload.len() as u64, 1, &place)?;
    Ok(from_base64(payload).ok())
}
