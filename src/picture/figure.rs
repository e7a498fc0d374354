//! Where the vertices of a figure are at a frame, and how light falls on them.

use std::collections::BTreeSet;

use glam::{Mat3, Mat4, Vec2, Vec3, Vec4, Vec4Swizzles};

use crate::model::{Appearance, Carrier, Surface};

use super::{error::PictureError, image::longest_side, texture::Texture};

/// Triangles of one figure.
const MAX_TRIANGLES: usize = 5_000_000;

/// What is drawn: surfaces with what they are painted with, ready to be posed.
#[derive(Clone, Debug)]
pub struct Figure {
    surfaces: Vec<Surface>,
    paints: Vec<crate::model::Paint>,
    /// One for each image; nothing of one that cannot be decoded.
    textures: Vec<Option<Texture>>,
}

/// A figure at one frame, in the space of the picture: +Y up, +Z front.
#[derive(Clone, Debug, Default)]
pub(super) struct Posed {
    /// Of all surfaces in their order.
    pub(super) positions: Vec<Vec3>,
    /// As long; not of unit length.
    pub(super) normals: Vec<Vec3>,
}

/// A surface of a figure, and where its vertices begin in what is posed.
pub(super) struct Drawn<'a> {
    pub(super) indices: &'a [u32],
    pub(super) first: usize,
    pub(super) texture_coordinates: &'a [Vec2],
    pub(super) colors: &'a [Vec4],
    pub(super) base_color: Vec4,
    pub(super) cut_out_below: f32,
    pub(super) opacity: f32,
    pub(super) texture: Option<&'a Texture>,
}

impl Figure {
    /// Takes what a scene looks like. Images that cannot be decoded leave their surfaces plain; the second value says which and why.
    ///
    /// # Errors
    /// When there are too many triangles.
    pub fn new(mut appearance: Appearance) -> Result<(Self, Vec<(usize, PictureError)>), PictureError> {
        let triangles = appearance.triangle_count();
        if triangles > MAX_TRIANGLES {
            return Err(PictureError::new(format!(
                "{triangles} triangles are more than the {MAX_TRIANGLES} that are drawn"
            )));
        }
        let mut problems = Vec::new();
        let mut textures = Vec::new();
        let used: BTreeSet<usize> = appearance.paints.iter().filter_map(|paint| paint.image).collect();
        let longest_side = longest_side(used.len());
        for (index, image) in appearance.images.iter().enumerate() {
            let texture = used.contains(&index).then(|| Texture::read(image, longest_side));
            textures.push(match texture {
                Some(Err(error)) => {
                    problems.push((index, error));
                    None
                }
                Some(Ok(texture)) => Some(texture),
                None => None,
            });
        }
        for surface in appearance.surfaces.iter_mut().filter(|surface| surface.normals.is_empty()) {
            surface.normals = smooth_normals(&surface.positions, &surface.indices);
        }
        let Appearance { surfaces, paints, .. } = appearance;
        Ok((Self { surfaces, paints, textures }, problems))
    }

    /// Whether there is nothing to draw.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.surfaces.iter().all(|surface| surface.indices.is_empty())
    }

    /// How many vertices there are.
    pub(super) fn vertex_count(&self) -> usize {
        self.surfaces.iter().map(|surface| surface.positions.len()).sum()
    }

    /// The figure as joints carry it, which are in the space of the picture, with the weights of all morphs of its scene.
    pub(super) fn pose(&self, joints: &[Mat4], morph_weights: &[f32], posed: &mut Posed) {
        posed.positions.clear();
        posed.normals.clear();
        let mut shaped: Vec<Vec3> = Vec::new();
        for surface in &self.surfaces {
            let is_shaped = |morph: usize| morph_weights.get(morph).copied().unwrap_or(0.0) != 0.0;
            let positions = if surface.shapes.iter().any(|shape| is_shaped(shape.morph)) {
                shaped.clear();
                shaped.extend_from_slice(&surface.positions);
                for shape in surface.shapes.iter().filter(|shape| is_shaped(shape.morph)) {
                    let weight = morph_weights[shape.morph];
                    shape.offsets.iter().for_each(|(vertex, offset)| shaped[*vertex as usize] += *offset * weight);
                }
                &shaped
            } else {
                &surface.positions
            };
            match &surface.carrier {
                Carrier::Joint(joint) => {
                    let matrix = joints[*joint];
                    let turn = normal_matrix(&matrix);
                    posed.positions.extend(positions.iter().map(|position| matrix.transform_point3(*position)));
                    posed.normals.extend(surface.normals.iter().map(|normal| turn * *normal));
                }
                Carrier::Skin { joints: bound, influences } => {
                    let matrices: Vec<Mat4> = bound.iter().map(|(joint, bind)| joints[*joint] * *bind).collect();
                    for (vertex, (position, normal)) in positions.iter().zip(&surface.normals).enumerate() {
                        let matrix = blended(&matrices, influences, vertex);
                        posed.positions.push(matrix.transform_point3(*position));
                        posed.normals.push(matrix.transform_vector3(*normal));
                    }
                }
            }
        }
    }

    /// The surfaces, opaque ones first.
    pub(super) fn drawn(&self) -> Vec<Drawn<'_>> {
        let mut first = 0;
        let mut drawn = Vec::with_capacity(self.surfaces.len());
        for surface in &self.surfaces {
            let paint = surface.paint.map_or_else(crate::model::Paint::default, |paint| self.paints[paint]);
            let texture = paint.image.and_then(|image| self.textures[image].as_ref());
            let opacity = if paint.is_blended { paint.base_color.w } else { 1.0 };
            drawn.push(Drawn {
                indices: &surface.indices,
                first,
                texture_coordinates: &surface.texture_coordinates,
                colors: &surface.colors,
                base_color: paint.base_color.xyz().extend(1.0),
                cut_out_below: paint.cut_out_below.unwrap_or(if paint.is_blended { 0.25 } else { 0.0 }),
                opacity,
                texture: texture.filter(|_| !surface.texture_coordinates.is_empty()),
            });
            first += surface.positions.len();
        }
        // What cannot be seen at all is there for other programs.
        drawn.retain(|surface| surface.opacity > 0.05);
        drawn
    }
}

fn blended(matrices: &[Mat4], influences: &[Vec<crate::model::FourInfluences>], vertex: usize) -> Mat4 {
    let mut sum = Mat4::ZERO;
    for set in influences {
        let four = &set[vertex];
        for (joint, share) in four.joints.iter().zip(four.shares) {
            if share > 0.0 {
                sum += matrices[usize::from(*joint)] * share;
            }
        }
    }
    sum
}

/// How normals turn with a matrix: as its cofactors say.
fn normal_matrix(matrix: &Mat4) -> Mat3 {
    let [x, y, z] = [matrix.x_axis.xyz(), matrix.y_axis.xyz(), matrix.z_axis.xyz()];
    Mat3::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// Normals of vertices: the sum of those of their triangles, by area.
fn smooth_normals(positions: &[Vec3], indices: &[u32]) -> Vec<Vec3> {
    let mut normals = vec![Vec3::ZERO; positions.len()];
    for triangle in indices.chunks_exact(3) {
        let [a, b, c] = [0, 1, 2].map(|corner: usize| triangle[corner] as usize);
        let normal = (positions[b] - positions[a]).cross(positions[c] - positions[a]);
        [a, b, c].into_iter().for_each(|vertex| normals[vertex] += normal);
    }
    normals.iter().map(|normal| normal.normalize_or_zero()).collect()
}
