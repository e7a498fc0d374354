//! Meshes, materials and images of a target that came from another format.
//!
//! A node that wears a mesh bound to joints should be a top one without a transform of its own (glTF 2.0, 3.7.3.3); where the target's
//! is not, the mesh goes to a node that is added behind all others.

use std::{borrow::Cow, collections::BTreeMap};

use glam::{Vec2, Vec3};
use serde_json::{Map, Value, json};

use super::{FLOAT, Output, animation::MorphNode, array, skins::Skins};
use crate::{
    formats::{
        FormatError,
        meshes::{FourInfluences, Image, Material, Mesh, Meshes, Shape, Texture},
    },
    model::{Canceled, Control, Scene, Transform},
};

const UNSIGNED_SHORT: u64 = 5123;
const UNSIGNED_INT: u64 = 5125;
/// What a view is for.
const VERTICES: u64 = 34962;
const INDICES: u64 = 34963;
const CLAMP_TO_EDGE: u64 = 33071;
const REPEAT: u64 = 10497;
/// Above this share of the vertices, listing those that a shape moves takes more than listing all.
const SPARSE_SHARE: f64 = 0.5;

/// Adds everything, and puts the meshes on their nodes. Says which nodes have shapes, for the animation.
pub(super) fn add<'a>(
    output: &mut Output<'a>,
    target: &Scene,
    meshes: Meshes<'a>,
    skins: &Skins,
    control: &Control,
) -> Result<Vec<MorphNode>, FormatError> {
    add_materials(output, &meshes.materials)?;
    add_images(output, &meshes.images)?;
    let mut morph_nodes = Vec::new();
    for (mesh, skin) in meshes.meshes.iter().zip(&skins.of_meshes) {
        let index = add_mesh(output, mesh, skin.as_ref().map(|(_, places)| places.as_slice()), control)?;
        for joint in &mesh.nodes {
            let node = wear(output, target, *joint, mesh, index, skin.as_ref().map(|(skin, _)| *skin))?;
            if !mesh.shapes.is_empty() {
                let (morphs, rest) = mesh.shapes.iter().map(|shape| (shape.morph, shape.rest)).unzip();
                morph_nodes.push(MorphNode { node, morphs, rest });
            }
        }
    }
    Ok(morph_nodes)
}

/// Puts a mesh on the node of a joint, or where that should not wear it on a new one, and says which.
fn wear(
    output: &mut Output<'_>,
    target: &Scene,
    joint: usize,
    mesh: &Mesh,
    index: usize,
    skin: Option<usize>,
) -> Result<usize, FormatError> {
    let of_target = &target.skeleton.joints()[joint];
    let is_plain_top = of_target.parent.is_none() && of_target.rest == Transform::IDENTITY;
    let nodes = array(&mut output.json, "nodes")?;
    if skin.is_none() || is_plain_top {
        nodes[joint]["mesh"] = json!(index);
        if let Some(skin) = skin {
            nodes[joint]["skin"] = json!(skin);
        }
        return Ok(joint);
    }
    nodes.push(json!({"name": format!("{}_mesh", mesh.name), "mesh": index, "skin": skin}));
    let node = nodes.len() - 1;
    if let Some(list) = output.json.get_mut("scenes").and_then(|scenes| scenes[0]["nodes"].as_array_mut()) {
        list.push(json!(node));
    }
    Ok(node)
}

fn add_mesh(
    output: &mut Output<'_>,
    mesh: &Mesh,
    places: Option<&[u16]>,
    control: &Control,
) -> Result<usize, FormatError> {
    let check = || control.check().map_err(|Canceled| FormatError::from(Canceled));
    check()?;
    let mut attributes = Map::new();
    attributes.insert("POSITION".into(), json!(add_positions(output, &mesh.positions)?));
    if !mesh.normals.is_empty() {
        let normals: &[[f32; 3]] = bytemuck::cast_slice(&mesh.normals);
        attributes.insert("NORMAL".into(), json!(add_vertices(output, normals, FLOAT, "VEC3")?));
    }
    for (set, uvs) in mesh.uv_sets.iter().enumerate() {
        let uvs: Vec<[f32; 2]> = uvs.iter().map(Vec2::to_array).collect();
        attributes.insert(format!("TEXCOORD_{set}"), json!(add_vertices(output, &uvs, FLOAT, "VEC2")?));
    }
    if let Some((binding, places)) = mesh.binding.as_ref().zip(places) {
        for (set, fours) in binding.influences.iter().enumerate() {
            let place = |slot: u16, share: f32| if share > 0.0 { places[usize::from(slot)] } else { 0 };
            let joints =
                |four: &FourInfluences| [0, 1, 2, 3].map(|index| place(four.joints[index], four.shares[index]));
            let joints: Vec<[u16; 4]> = fours.iter().map(joints).collect();
            let shares: Vec<[f32; 4]> = fours.iter().map(|four| four.shares).collect();
            attributes.insert(format!("JOINTS_{set}"), json!(add_vertices(output, &joints, UNSIGNED_SHORT, "VEC4")?));
            attributes.insert(format!("WEIGHTS_{set}"), json!(add_vertices(output, &shares, FLOAT, "VEC4")?));
        }
    }
    let mut targets = Vec::with_capacity(mesh.shapes.len());
    for shape in &mesh.shapes {
        check()?;
        targets.push(json!({"POSITION": add_shape(output, shape, mesh.positions.len())?}));
    }
    let mut primitives = Vec::with_capacity(mesh.parts.len());
    for part in &mesh.parts {
        let view = output.add_values(&part.indices, Some(INDICES))?;
        let indices = output.add_accessor(json!({
            "bufferView": view, "componentType": UNSIGNED_INT, "count": part.indices.len(), "type": "SCALAR",
        }))?;
        let mut primitive = json!({"attributes": attributes, "indices": indices});
        if let Some(material) = part.material {
            primitive["material"] = json!(material);
        }
        if !targets.is_empty() {
            primitive["targets"] = json!(targets);
        }
        primitives.push(primitive);
    }
    let mut value = json!({"primitives": primitives});
    if !mesh.name.is_empty() {
        value["name"] = json!(mesh.name);
    }
    if !mesh.shapes.is_empty() {
        value["weights"] = json!(mesh.shapes.iter().map(|shape| shape.rest).collect::<Vec<_>>());
        value["extras"] = json!({"targetNames": mesh.shapes.iter().map(|shape| &*shape.name).collect::<Vec<_>>()});
    }
    let meshes = array(&mut output.json, "meshes")?;
    meshes.push(value);
    Ok(meshes.len() - 1)
}

/// Positions, with the bounds that the specification asks for.
/// Places of vertices, with their bounds; there is at least one.
pub(super) fn add_positions(output: &mut Output<'_>, positions: &[Vec3]) -> Result<usize, FormatError> {
    let numbers: &[[f32; 3]] = bytemuck::cast_slice(positions);
    let index = add_vertices(output, numbers, FLOAT, "VEC3")?;
    bounded(output, index, positions.iter().copied())?;
    Ok(index)
}

fn bounded(output: &mut Output<'_>, accessor: usize, positions: impl Iterator<Item = Vec3>) -> Result<(), FormatError> {
    let begin = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = positions.fold(begin, |(low, high), place| (low.min(place), high.max(place)));
    let accessor = &mut array(&mut output.json, "accessors")?[accessor];
    accessor["min"] = json!(low.to_array());
    accessor["max"] = json!(high.to_array());
    Ok(())
}

/// By how far a shape moves every vertex, or those that it moves.
fn add_shape(output: &mut Output<'_>, shape: &Shape, count: usize) -> Result<usize, FormatError> {
    if shape.offsets.len() as f64 > count as f64 * SPARSE_SHARE {
        let mut all = vec![Vec3::ZERO; count];
        shape.offsets.iter().for_each(|(vertex, offset)| all[*vertex as usize] = *offset);
        return add_positions(output, &all);
    }
    let mut accessor = json!({"componentType": FLOAT, "count": count, "type": "VEC3"});
    if !shape.offsets.is_empty() {
        let (vertices, offsets): (Vec<u32>, Vec<Vec3>) = shape.offsets.iter().copied().unzip();
        let indices = output.add_values(&vertices, None)?;
        let values = output.add_values(&offsets, None)?;
        accessor["sparse"] = json!({
            "count": vertices.len(),
            "indices": {"bufferView": indices, "componentType": UNSIGNED_INT},
            "values": {"bufferView": values},
        });
    }
    let index = output.add_accessor(accessor)?;
    // What is not listed does not move.
    bounded(output, index, shape.offsets.iter().map(|(_, offset)| *offset).chain([Vec3::ZERO]))?;
    Ok(index)
}

/// Values of vertices, one for each.
pub(super) fn add_vertices<T: bytemuck::Pod>(
    output: &mut Output<'_>,
    values: &[T],
    component: u64,
    shape: &str,
) -> Result<usize, FormatError> {
    let view = output.add_values(values, Some(VERTICES))?;
    output.add_accessor(json!({"bufferView": view, "componentType": component, "count": values.len(), "type": shape}))
}

fn add_images<'a>(output: &mut Output<'a>, images: &[Image<'a>]) -> Result<(), FormatError> {
    for image in images {
        let view = output.add_view(Cow::Borrowed(image.bytes), None)?;
        let mut value = json!({"mimeType": image.media_type, "bufferView": view});
        if !image.name.is_empty() {
            value["name"] = json!(image.name);
        }
        array(&mut output.json, "images")?.push(value);
    }
    Ok(())
}

fn add_materials(output: &mut Output<'_>, materials: &[Material<'_>]) -> Result<(), FormatError> {
    let mut textures: BTreeMap<(usize, [bool; 2]), usize> = BTreeMap::new();
    for material in materials {
        let [base, glow, normal] = [material.base_color_texture, material.emissive_texture, material.normal_texture]
            .map(|texture| {
                texture.map(|texture| {
                    let next = textures.len();
                    let index = *textures.entry((texture.image, texture.is_clamped)).or_insert(next);
                    reference(index, texture)
                })
            });
        let mut surface = json!({
            "baseColorFactor": material.base_color,
            "metallicFactor": material.metallic,
            "roughnessFactor": material.roughness,
        });
        let mut value = Map::new();
        if !material.name.is_empty() {
            value.insert("name".into(), material.name.into());
        }
        if let Some(base) = base {
            surface["baseColorTexture"] = base;
        }
        value.insert("pbrMetallicRoughness".into(), surface);
        if let Some(normal) = normal {
            value.insert("normalTexture".into(), normal);
        }
        if let Some(glow) = glow {
            value.insert("emissiveTexture".into(), glow);
        }
        if material.emissive != [0.0; 3] {
            value.insert("emissiveFactor".into(), json!(material.emissive));
        }
        let is_see_through = material.base_color[3] < 1.0;
        if is_see_through || material.is_cut_out {
            value.insert("alphaMode".into(), if is_see_through { "BLEND" } else { "MASK" }.into());
        }
        // Programs that read FBX show both sides.
        value.insert("doubleSided".into(), true.into());
        array(&mut output.json, "materials")?.push(Value::Object(value));
    }
    let mut in_order: Vec<_> = textures.into_iter().collect();
    in_order.sort_by_key(|(_, index)| *index);
    for ((image, is_clamped), index) in in_order {
        let [along_u, along_v] = is_clamped.map(|clamps| if clamps { CLAMP_TO_EDGE } else { REPEAT });
        array(&mut output.json, "samplers")?.push(json!({"wrapS": along_u, "wrapT": along_v}));
        array(&mut output.json, "textures")?.push(json!({"source": image, "sampler": index}));
    }
    Ok(())
}

fn reference(index: usize, texture: Texture) -> Value {
    if texture.uv_set == 0 { json!({"index": index}) } else { json!({"index": index, "texCoord": texture.uv_set}) }
}
