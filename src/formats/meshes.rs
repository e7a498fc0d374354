//! The meshes of a target in a form that is no format's own: triangles with what lies on their corners, the joints that move them,
//! the shapes that they can take, and what they are painted with.
//!
//! Made by the reader of one format for the writer of another. All numbers are finite, all indices in range.

use glam::{DMat4, Vec2, Vec3};

pub(super) use crate::model::FourInfluences;

/// All meshes that nodes of a skeleton wear.
#[derive(Debug, Default)]
pub(super) struct Meshes<'a> {
    pub(super) meshes: Vec<Mesh>,
    pub(super) materials: Vec<Material<'a>>,
    pub(super) images: Vec<Image<'a>>,
}

/// A mesh, in the space of the node that wears it, or where it is bound to joints in a space of its own.
#[derive(Debug)]
pub(super) struct Mesh {
    /// May be empty.
    pub(super) name: String,
    /// The joints whose nodes wear it.
    pub(super) nodes: Vec<usize>,
    pub(super) positions: Vec<Vec3>,
    /// Unit vectors, one for each position; none where the file has none.
    pub(super) normals: Vec<Vec3>,
    /// One for each position in each set; V goes down.
    pub(super) uv_sets: Vec<Vec<Vec2>>,
    /// Triangles, by what they are painted with.
    pub(super) parts: Vec<Part>,
    pub(super) binding: Option<Binding>,
    pub(super) shapes: Vec<Shape>,
}

/// Triangles of one material.
#[derive(Debug)]
pub(super) struct Part {
    /// Index in [`Meshes::materials`].
    pub(super) material: Option<usize>,
    /// Three for each triangle, counter-clockwise from outside.
    pub(super) indices: Vec<u32>,
}

/// Which joints move a mesh.
#[derive(Debug)]
pub(super) struct Binding {
    /// The skin's name; may be empty.
    pub(super) name: String,
    /// Joints of the skeleton, each once, and `joint_from_vertex` of the pose in which they were bound.
    pub(super) joints: Vec<(usize, DMat4)>,
    /// For each position the joints that move it, as indices in `joints`, with their shares, largest first, which are 1 together. As
    /// many sets of four as the most of them need.
    pub(super) influences: Vec<Vec<FourInfluences>>,
}

/// A shape that a mesh can take.
#[derive(Debug)]
pub(super) struct Shape {
    pub(super) name: String,
    /// Which of [`Scene::morphs`](crate::model::Scene::morphs) it is.
    pub(super) morph: Option<usize>,
    /// Its weight where nothing animates it.
    pub(super) rest: f32,
    /// By how far it moves positions at weight 1, by their rising indices.
    pub(super) offsets: Vec<(u32, Vec3)>,
}

/// A plain material of metal and roughness.
#[derive(Debug)]
pub(super) struct Material<'a> {
    pub(super) name: &'a str,
    /// Red, green, blue, linear, and opacity, 0 to 1.
    pub(super) base_color: [f64; 4],
    pub(super) emissive: [f64; 3],
    pub(super) metallic: f64,
    pub(super) roughness: f64,
    pub(super) is_cut_out: bool,
    pub(super) base_color_texture: Option<Texture>,
    pub(super) emissive_texture: Option<Texture>,
    pub(super) normal_texture: Option<Texture>,
}

/// An image on a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Texture {
    /// Index in [`Meshes::images`].
    pub(super) image: usize,
    pub(super) uv_set: usize,
    /// Whether the image ends at its edge instead of beginning again, along U and V.
    pub(super) is_clamped: [bool; 2],
}

/// An image as a file has it.
#[derive(Debug)]
pub(super) struct Image<'a> {
    pub(super) name: &'a str,
    /// `image/png` or `image/jpeg`.
    pub(super) media_type: &'static str,
    pub(super) bytes: &'a [u8],
}
