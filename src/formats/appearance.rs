//! What a scene looks like, from the format that it came from.

use std::collections::BTreeSet;

use glam::{Vec4, Vec4Swizzles};

use crate::model::{Appearance, Carrier, Control, Paint, Reporter, Scene, Surface, SurfaceShape};

use super::{
    Budget, FormatError, Limits, gltf,
    meshes::{Mesh, Meshes, Part},
    written,
};

/// What a scene looks like: empty where its file has no meshes. Of the shapes that surfaces can take, those of the wanted morphs alone
/// are there, by their indices in [`Scene::morphs`].
///
/// Meshes that cannot be decoded are left out and reported.
///
/// # Errors
/// When the meshes exceed the limits, or the work is canceled.
pub fn appearance(
    scene: &Scene,
    wanted: &BTreeSet<usize>,
    limits: &Limits,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Appearance, FormatError> {
    if let Some(found) = gltf::appearance(scene, wanted, &mut Budget::new(limits, control), reporter)? {
        return Ok(found);
    }
    let meshes = written::meshes(scene, control, reporter)?;
    Ok(meshes.map(|meshes| from_meshes(&meshes, wanted)).unwrap_or_default())
}

fn from_meshes(meshes: &Meshes<'_>, wanted: &BTreeSet<usize>) -> Appearance {
    let paint = |material: &super::meshes::Material<'_>| Paint {
        base_color: Vec4::from_array(material.base_color.map(|part| part as f32)),
        image: material.base_color_texture.map(|texture| texture.image),
        cut_out_below: material.is_cut_out.then_some(0.5),
        is_blended: false,
    };
    let mut found = Appearance {
        surfaces: Vec::new(),
        paints: meshes.materials.iter().map(paint).collect(),
        images: meshes.images.iter().map(|image| image.bytes.to_vec()).collect(),
    };
    for mesh in &meshes.meshes {
        for part in mesh.parts.iter().filter(|part| !part.indices.is_empty()) {
            let texture = part.material.and_then(|material| meshes.materials[material].base_color_texture);
            let set = texture.map_or(0, |texture| texture.uv_set);
            let uses = if mesh.binding.is_some() { &mesh.nodes[..mesh.nodes.len().min(1)] } else { &mesh.nodes[..] };
            found.surfaces.extend(uses.iter().map(|node| surface(mesh, part, *node, set, wanted)));
        }
    }
    found
}

/// A part of a mesh, with those vertices alone that its triangles use.
fn surface(mesh: &Mesh, part: &Part, node: usize, uv_set: usize, wanted: &BTreeSet<usize>) -> Surface {
    let mut place_of = vec![u32::MAX; mesh.positions.len()];
    let mut used: Vec<usize> = Vec::new();
    let indices = part.indices.iter().map(|&vertex| {
        let place = &mut place_of[vertex as usize];
        if *place == u32::MAX {
            *place = used.len() as u32;
            used.push(vertex as usize);
        }
        *place
    });
    let indices = indices.collect();
    let carrier = mesh.binding.as_ref().map_or(Carrier::Joint(node), |binding| Carrier::Skin {
        joints: binding.joints.iter().map(|(joint, matrix)| (*joint, matrix.as_mat4())).collect(),
        influences: binding.influences.iter().map(|set| used.iter().map(|vertex| set[*vertex]).collect()).collect(),
    });
    let shapes = mesh.shapes.iter().filter_map(|shape| {
        let morph = shape.morph.filter(|morph| wanted.contains(morph))?;
        let offsets = shape.offsets.iter().map(|(vertex, offset)| (place_of[*vertex as usize], *offset));
        let mut offsets: Vec<_> = offsets.filter(|(place, _)| *place != u32::MAX).collect();
        offsets.sort_by_key(|(place, _)| *place);
        Some(SurfaceShape { morph, offsets })
    });
    Surface {
        normals: if mesh.normals.is_empty() { Vec::new() } else { used.iter().map(|at| mesh.normals[*at]).collect() },
        texture_coordinates: mesh
            .uv_sets
            .get(uv_set)
            .map_or_else(Vec::new, |set| used.iter().map(|at| set[*at]).collect()),
        colors: Vec::new(),
        shapes: shapes.collect(),
        positions: used.iter().map(|at| mesh.positions[*at]).collect(),
        indices,
        paint: part.material,
        carrier,
    }
}

/// What a color of a file that may say anything is taken to be.
pub(super) fn sane_color(color: Vec4) -> Vec4 {
    let is_sane = color.is_finite();
    if is_sane {
        color.xyz().clamp(glam::Vec3::ZERO, glam::Vec3::ONE).extend(color.w.clamp(0.0, 1.0))
    } else {
        Vec4::ONE
    }
}
