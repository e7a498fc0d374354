//! Polygons to triangles, and corners to vertices: corners that are alike in everything are one.

use std::collections::BTreeMap;

use glam::{DMat3, Vec2, Vec3};

use super::{
    super::geometry::{self, vector},
    TooLarge, Work,
};

/// No vertex: the corner of a point, a line or a hole.
const NONE: u32 = u32::MAX;

/// The vertices that triangles need.
pub(super) struct Corners<'m> {
    mesh: &'m ufbx::Mesh,
    /// Face and corners of each triangle.
    triangles: Vec<(u32, [u32; 3])>,
    /// For each corner of the mesh its vertex here.
    vertex_of_corner: Vec<u32>,
    /// For each vertex here that of the mesh, and a corner that is it.
    vertices: Vec<u32>,
    corner_of_vertex: Vec<u32>,
    /// For each corner; none where the mesh has none.
    normals: Vec<Vec3>,
}

impl<'m> Corners<'m> {
    pub(super) fn new(work: &mut Work<'_>, mesh: &'m ufbx::Mesh, normal_turn: &DMat3) -> Result<Self, TooLarge> {
        let count = mesh.num_indices;
        let sets = mesh.uv_sets.iter().filter(|set| set.vertex_uv.exists).count();
        let width = 4 + 2 * sets;
        work.take(count, 4 * width + size_of::<[Vec3; 3]>() + sets * size_of::<Vec2>() + 64)?;
        let triangles = triangles(mesh);
        let normals = normals(mesh, normal_turn);
        let mut keys: Vec<u32> = Vec::with_capacity(count * width);
        for corner in 0..count {
            keys.push(mesh.vertex_indices[corner]);
            keys.extend(normals.get(corner).copied().unwrap_or_default().to_array().map(f32::to_bits));
            keys.extend(uv_sets(mesh).flat_map(|set| uv(set, corner).to_array()).map(f32::to_bits));
        }
        let mut vertex_of_corner = vec![NONE; count];
        let (mut vertices, mut corner_of_vertex) = (Vec::new(), Vec::new());
        let mut known: BTreeMap<&[u32], u32> = BTreeMap::new();
        for corner in triangles.iter().flat_map(|(_, corners)| *corners) {
            let index = corner as usize;
            let next = vertices.len() as u32;
            let vertex = *known.entry(&keys[index * width..(index + 1) * width]).or_insert(next);
            if vertex == next {
                vertices.push(mesh.vertex_indices[index]);
                corner_of_vertex.push(corner);
            }
            vertex_of_corner[index] = vertex;
        }
        Ok(Self { mesh, triangles, vertex_of_corner, vertices, corner_of_vertex, normals })
    }

    /// For each vertex here that of the mesh.
    pub(super) fn vertices(&self) -> &[u32] {
        &self.vertices
    }

    /// The face of each triangle, and its vertices here.
    pub(super) fn triangles(&self) -> impl Iterator<Item = (usize, [u32; 3])> {
        let vertex = |corner: u32| self.vertex_of_corner[corner as usize];
        self.triangles.iter().map(move |(face, corners)| (*face as usize, corners.map(vertex)))
    }

    pub(super) fn normals(&self) -> Vec<Vec3> {
        if self.normals.is_empty() {
            return Vec::new();
        }
        self.corner_of_vertex.iter().map(|corner| self.normals[*corner as usize]).collect()
    }

    pub(super) fn uv_sets(&self) -> Vec<Vec<Vec2>> {
        let of = |set| self.corner_of_vertex.iter().map(|corner| uv(set, *corner as usize)).collect();
        uv_sets(self.mesh).map(of).collect()
    }
}

/// The triangles of all faces but holes, with their faces.
fn triangles(mesh: &ufbx::Mesh) -> Vec<(u32, [u32; 3])> {
    let mut triangles = Vec::with_capacity(mesh.num_triangles);
    let mut corners = Vec::new();
    for (index, face) in mesh.faces.iter().enumerate() {
        let range = geometry::corners(face);
        let is_hole = mesh.face_hole.as_ref().get(index).is_some_and(|is_hole| *is_hole);
        if range.len() < 3 || range.end > mesh.num_indices || is_hole {
            continue;
        }
        let count = ufbx::triangulate_face_vec(&mut corners, mesh, *face) as usize;
        triangles.extend(corners.as_chunks().0.iter().take(count).map(|corners| (index as u32, *corners)));
    }
    triangles
}

fn normals(mesh: &ufbx::Mesh, turn: &DMat3) -> Vec<Vec3> {
    if !mesh.vertex_normal.exists {
        return Vec::new();
    }
    let normal = |index: &u32| {
        let normal = mesh.vertex_normal.values.as_ref().get(*index as usize);
        let turned = normal.map(|normal| (*turn * vector(normal)).normalize_or_zero().as_vec3());
        // A direction is asked for; where there is none any will do.
        turned.and_then(Vec3::try_normalize).unwrap_or(Vec3::Y)
    };
    mesh.vertex_normal.indices.iter().map(normal).collect()
}

fn uv_sets(mesh: &ufbx::Mesh) -> impl Iterator<Item = &ufbx::VertexVec2> {
    mesh.uv_sets.iter().map(|set| &set.vertex_uv).filter(|set| set.exists)
}

/// Where a corner lies on an image whose first row is the upper one.
fn uv(set: &ufbx::VertexVec2, corner: usize) -> Vec2 {
    let uv = set.indices.as_ref().get(corner).and_then(|index| set.values.as_ref().get(*index as usize));
    let uv = uv.map(|uv| Vec2::new(uv.x as f32, (1.0 - uv.y) as f32));
    uv.filter(|uv| uv.is_finite()).unwrap_or_default()
}
