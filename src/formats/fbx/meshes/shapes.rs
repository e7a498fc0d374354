//! Blend shapes, as far as they move each vertex.

use std::collections::BTreeMap;

use glam::{DMat3, DMat4, DVec3, Vec3};

use crate::formats::meshes::Shape;

use super::{super::geometry::vector, TooLarge, Work};

/// The shapes of a mesh whose vertices `place` puts where they are; `vertices` are those of the mesh, each as often as it is needed.
pub(super) fn shapes(
    work: &mut Work<'_>,
    mesh: &ufbx::Mesh,
    place: &DMat4,
    vertices: &[u32],
) -> Result<Vec<Shape>, TooLarge> {
    let channels: Vec<&ufbx::BlendChannel> =
        mesh.blend_deformers.iter().flat_map(|deformer| &deformer.channels).collect();
    if channels.is_empty() {
        return Ok(Vec::new());
    }
    work.take(vertices.len() + mesh.vertices.len(), size_of::<(u32, u32)>())?;
    let mut copies: Vec<(u32, u32)> = vertices.iter().zip(0..).map(|(vertex, index)| (*vertex, index)).collect();
    copies.sort_unstable();
    let copies_of = |vertex: u32| {
        let begin = copies.partition_point(|copy| copy.0 < vertex);
        copies[begin..].iter().take_while(move |copy| copy.0 == vertex).map(|copy| copy.1)
    };
    let turn = DMat3::from_mat4(*place);
    let mut shapes = Vec::with_capacity(channels.len());
    for channel in channels {
        if channel.keyframes.len() > 1 {
            work.lost.note("shapes between nothing and the whole", &channel.element.name);
        }
        // The last one is that of the full weight.
        let shape = channel.keyframes.iter().next_back().map(|key| &key.shape);
        let mut offsets: Vec<(u32, Vec3)> = Vec::new();
        if let Some(shape) = shape {
            let moved = shape.offset_vertices.iter().zip(shape.position_offsets.iter());
            let by_vertex: BTreeMap<u32, DVec3> =
                moved.map(|(vertex, offset)| (*vertex, turn * vector(offset))).collect();
            let count = by_vertex.keys().map(|vertex| copies_of(*vertex).count()).sum();
            work.take(count, size_of::<(u32, Vec3)>())?;
            offsets.reserve(count);
            for (vertex, offset) in by_vertex {
                let offset = offset.as_vec3();
                if offset.is_finite() && offset != Vec3::ZERO {
                    offsets.extend(copies_of(vertex).map(|copy| (copy, offset)));
                }
            }
            offsets.sort_unstable_by_key(|(vertex, _)| *vertex);
        }
        let morph = work.morph_of_shape.get(&(channel.element.typed_id as usize)).copied();
        let name =
            morph.map_or_else(|| channel.element.name.to_string(), |morph| work.target.morphs[morph].name.clone());
        let rest = morph.map_or(0.0, |morph| work.target.morphs[morph].rest);
        shapes.push(Shape { name, morph, rest, offsets });
    }
    Ok(shapes)
}
