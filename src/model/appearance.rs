//! What a scene looks like: the surfaces that its joints move, and what they are painted with.

use glam::{Mat4, Vec2, Vec3, Vec4};

/// Everything of a scene that can be seen. Nothing where its file has no meshes.
///
/// Made by a format's reader: all numbers are finite, and all indices are in range.
#[derive(Clone, Debug, Default)]
pub struct Appearance {
    /// Triangles of one material each.
    pub surfaces: Vec<Surface>,
    /// What surfaces are painted with.
    pub paints: Vec<Paint>,
    /// PNG or JPEG files, as the file has them.
    pub images: Vec<Vec<u8>>,
}

/// Triangles of one material.
#[derive(Clone, Debug)]
pub struct Surface {
    /// In the space of the mesh.
    pub positions: Vec<Vec3>,
    /// Unit vectors, one for each position, or none.
    pub normals: Vec<Vec3>,
    /// Where each position is on the texture of the paint, V down; or none.
    pub texture_coordinates: Vec<Vec2>,
    /// Linear red, green, blue and opacity of each position; or none.
    pub colors: Vec<Vec4>,
    /// Three for each triangle.
    pub indices: Vec<u32>,
    /// Index in [`Appearance::paints`].
    pub paint: Option<usize>,
    /// What moves it.
    pub carrier: Carrier,
    /// Shapes that it can take.
    pub shapes: Vec<SurfaceShape>,
}

/// What moves a surface.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// One joint, in whose space the surface is.
    Joint(usize),
    /// Several joints, by shares.
    Skin {
        /// Joints of the skeleton, and `joint_from_vertex` of the pose in which they were bound.
        joints: Vec<(usize, Mat4)>,
        /// Sets of one element for each position.
        influences: Vec<Vec<FourInfluences>>,
    },
}

/// Four joints of a skin and their shares; a share of 0 is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FourInfluences {
    /// Indices in the joints of the skin.
    pub joints: [u16; 4],
    /// Those of all sets of a position are 1 together.
    pub shares: [f32; 4],
}

/// A shape that a surface can take.
#[derive(Clone, Debug)]
pub struct SurfaceShape {
    /// Index in [`super::Scene::morphs`].
    pub morph: usize,
    /// By how far it moves positions at weight 1, by their rising indices.
    pub offsets: Vec<(u32, Vec3)>,
}

/// What a surface is painted with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Paint {
    /// Linear red, green, blue and opacity.
    pub base_color: Vec4,
    /// Index in [`Appearance::images`].
    pub image: Option<usize>,
    /// What is less opaque is not there.
    pub cut_out_below: Option<f32>,
    /// Whether what is less opaque lets through what is behind it.
    pub is_blended: bool,
}

impl Default for Paint {
    fn default() -> Self {
        Self { base_color: Vec4::new(0.8, 0.8, 0.8, 1.0), image: None, cut_out_below: None, is_blended: false }
    }
}

impl Appearance {
    /// How many triangles there are.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.surfaces.iter().map(|surface| surface.indices.len() / 3).sum()
    }
}
