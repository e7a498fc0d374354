//! Meshes, materials and images of a target that came from another format.
//!
//! A node that wears a mesh bound to joints should be a top one without a transform of its own (glTF 2.0, 3.7.3.3); where the target's
//! is not, the mesh goes to a node that is added behind all others.

use std::{borrow::Cow, collections::BTreeMap};

use glam::{Vec2, Vec3};
use serde_json::Map;

use super::{
    Output,
    animation::MorphNode,
    array,
    schema::{
        self, Accessor, Bounds, Component, List, MeshExtras, MorphTarget, Node, Primitive, Sparse, SparseIndices,
        SparseValues, Surface, Target, TextureInfo, TextureSampler, Wrap,
    },
    skins::Skins,
};
use crate::{
    formats::{
        FormatError,
        meshes::{FourInfluences, Image, Material, Mesh, Meshes, Shape, Texture},
    },
    model::{Canceled, Control, Scene, Transform},
};

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
        nodes[joint]["mesh"] = index.into();
        if let Some(skin) = skin {
            nodes[joint]["skin"] = skin.into();
        }
        return Ok(joint);
    }
    let name = format!("{}_mesh", mesh.name);
    let node = output.push(List::Nodes, &Node { name: &name, mesh: Some(index), skin, ..Node::default() })?;
    if let Some(list) = output.json.get_mut("scenes").and_then(|scenes| scenes[0]["nodes"].as_array_mut()) {
        list.push(node.into());
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
    attributes.insert("POSITION".into(), add_positions(output, &mesh.positions)?.into());
    if !mesh.normals.is_empty() {
        let normals: &[[f32; 3]] = bytemuck::cast_slice(&mesh.normals);
        attributes
            .insert("NORMAL".into(), add_vertices(output, normals, Component::Float, schema::Shape::Vec3)?.into());
    }
    for (set, uvs) in mesh.uv_sets.iter().enumerate() {
        let uvs: Vec<[f32; 2]> = uvs.iter().map(Vec2::to_array).collect();
        attributes.insert(
            format!("TEXCOORD_{set}"),
            add_vertices(output, &uvs, Component::Float, schema::Shape::Vec2)?.into(),
        );
    }
    if let Some((binding, places)) = mesh.binding.as_ref().zip(places) {
        for (set, fours) in binding.influences.iter().enumerate() {
            let place = |slot: u16, share: f32| if share > 0.0 { places[usize::from(slot)] } else { 0 };
            let joints =
                |four: &FourInfluences| [0, 1, 2, 3].map(|index| place(four.joints[index], four.shares[index]));
            let joints: Vec<[u16; 4]> = fours.iter().map(joints).collect();
            let shares: Vec<[f32; 4]> = fours.iter().map(|four| four.shares).collect();
            let joints = add_vertices(output, &joints, Component::UnsignedShort, schema::Shape::Vec4)?;
            attributes.insert(format!("JOINTS_{set}"), joints.into());
            let weights = add_vertices(output, &shares, Component::Float, schema::Shape::Vec4)?;
            attributes.insert(format!("WEIGHTS_{set}"), weights.into());
        }
    }
    let mut targets = Vec::with_capacity(mesh.shapes.len());
    for shape in &mesh.shapes {
        check()?;
        targets.push(MorphTarget { position: add_shape(output, shape, mesh.positions.len())? });
    }
    let mut primitives = Vec::with_capacity(mesh.parts.len());
    for part in &mesh.parts {
        let view = output.add_values(&part.indices, Some(Target::Indices))?;
        let indices = Accessor::of_view(view, Component::UnsignedInt, part.indices.len(), schema::Shape::Scalar);
        let indices = output.add_accessor(&indices)?;
        primitives.push(Primitive { attributes: &attributes, indices, material: part.material, targets: &targets });
    }
    let weights = mesh.shapes.iter().map(|shape| shape.rest).collect();
    let target_names: Vec<&str> = mesh.shapes.iter().map(|shape| &*shape.name).collect();
    let extras = (!target_names.is_empty()).then_some(MeshExtras { target_names });
    output.push(List::Meshes, &schema::Mesh { primitives, name: &mesh.name, weights, extras })
}

/// Positions, with the bounds that the specification asks for.
/// Places of vertices, with their bounds; there is at least one.
pub(super) fn add_positions(output: &mut Output<'_>, positions: &[Vec3]) -> Result<usize, FormatError> {
    let numbers: &[[f32; 3]] = bytemuck::cast_slice(positions);
    let view = output.add_values(numbers, Some(Target::Vertices))?;
    let bounds = Some(bounds(positions.iter().copied()));
    let accessor = Accessor::of_view(view, Component::Float, positions.len(), schema::Shape::Vec3);
    output.add_accessor(&Accessor { bounds, ..accessor })
}

fn bounds(positions: impl Iterator<Item = Vec3>) -> Bounds {
    let begin = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (low, high) = positions.fold(begin, |(low, high), place| (low.min(place), high.max(place)));
    Bounds { min: low.to_array().to_vec(), max: high.to_array().to_vec() }
}

/// By how far a shape moves every vertex, or those that it moves.
fn add_shape(output: &mut Output<'_>, shape: &Shape, count: usize) -> Result<usize, FormatError> {
    if shape.offsets.len() as f64 > count as f64 * SPARSE_SHARE {
        let mut all = vec![Vec3::ZERO; count];
        shape.offsets.iter().for_each(|(vertex, offset)| all[*vertex as usize] = *offset);
        return add_positions(output, &all);
    }
    let mut sparse = None;
    if !shape.offsets.is_empty() {
        let (vertices, offsets): (Vec<u32>, Vec<Vec3>) = shape.offsets.iter().copied().unzip();
        let indices = output.add_values(&vertices, None)?;
        let values = output.add_values(&offsets, None)?;
        sparse = Some(Sparse {
            count: vertices.len(),
            indices: SparseIndices { buffer_view: indices, component_type: Component::UnsignedInt },
            values: SparseValues { buffer_view: values },
        });
    }
    // What is not listed does not move.
    let bounds = Some(bounds(shape.offsets.iter().map(|(_, offset)| *offset).chain([Vec3::ZERO])));
    let accessor = Accessor::new(Component::Float, count, schema::Shape::Vec3);
    output.add_accessor(&Accessor { sparse, bounds, ..accessor })
}

/// Values of vertices, one for each.
pub(super) fn add_vertices<T: bytemuck::Pod>(
    output: &mut Output<'_>,
    values: &[T],
    component: Component,
    shape: schema::Shape,
) -> Result<usize, FormatError> {
    let view = output.add_values(values, Some(Target::Vertices))?;
    output.add_accessor(&Accessor::of_view(view, component, values.len(), shape))
}

fn add_images<'a>(output: &mut Output<'a>, images: &[Image<'a>]) -> Result<(), FormatError> {
    for image in images {
        let view = output.add_view(Cow::Borrowed(image.bytes), None)?;
        let image = schema::Image { mime_type: image.media_type, buffer_view: view, name: image.name };
        output.push(List::Images, &image)?;
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
        let is_see_through = material.base_color[3] < 1.0;
        let alpha_mode =
            (is_see_through || material.is_cut_out).then_some(if is_see_through { "BLEND" } else { "MASK" });
        let pbr_metallic_roughness = Surface {
            base_color_factor: material.base_color,
            metallic_factor: material.metallic,
            roughness_factor: material.roughness,
            base_color_texture: base,
        };
        let material = schema::Material {
            name: material.name,
            pbr_metallic_roughness,
            normal_texture: normal,
            emissive_texture: glow,
            emissive_factor: (material.emissive != [0.0; 3]).then_some(material.emissive),
            alpha_mode,
            // Programs that read FBX show both sides.
            double_sided: true,
        };
        output.push(List::Materials, &material)?;
    }
    let mut in_order: Vec<_> = textures.into_iter().collect();
    in_order.sort_by_key(|(_, index)| *index);
    for ((source, is_clamped), sampler) in in_order {
        let [wrap_s, wrap_t] = is_clamped.map(|clamps| if clamps { Wrap::Clamp } else { Wrap::Repeat });
        output.push(List::Samplers, &TextureSampler { wrap_s, wrap_t })?;
        output.push(List::Textures, &schema::Texture { source, sampler })?;
    }
    Ok(())
}

const fn reference(index: usize, texture: Texture) -> TextureInfo {
    TextureInfo { index, tex_coord: texture.uv_set }
}
