//! The parser's numbers and lists of geometry in our types.

use std::ops::Range;

use glam::{DMat3, DMat4, DVec3};

pub(super) const fn vector(vector: &ufbx::Vec3) -> DVec3 {
    DVec3::new(vector.x, vector.y, vector.z)
}

pub(super) fn matrix(matrix: &ufbx::Matrix) -> DMat4 {
    DMat4::from_cols_array(&[
        matrix.m00, matrix.m10, matrix.m20, 0.0, matrix.m01, matrix.m11, matrix.m21, 0.0, matrix.m02, matrix.m12,
        matrix.m22, 0.0, matrix.m03, matrix.m13, matrix.m23, 1.0,
    ])
}

/// Turns normals as the inverse transpose does; as it is where the space is flat.
pub(super) fn normal_turn(matrix: &DMat4) -> DMat3 {
    let turn = DMat3::from_mat4(*matrix).inverse().transpose();
    if turn.is_finite() { turn } else { DMat3::IDENTITY }
}

/// The corners of a face, as indices of the lists of corners.
pub(super) fn corners(face: &ufbx::Face) -> Range<usize> {
    face.index_begin as usize..face.index_begin as usize + face.num_indices as usize
}

/// The materials of a mesh below its node, as the indices of its faces count them.
pub(super) fn materials<'a>(node: &'a ufbx::Node, mesh: &'a ufbx::Mesh) -> impl Iterator<Item = &'a ufbx::Material> {
    let list = if node.materials.is_empty() { &mesh.materials } else { &node.materials };
    list.into_iter()
}
