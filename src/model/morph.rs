//! Morph targets, facial expressions and custom properties: numbers beside the joints, over time.

use glam::Vec3;

use super::Track;

/// Something that a face, or any mesh, can do: a morph target, or an expression made of several; or a number that is animated beside
/// the joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Morph {
    /// Its name in the file; `target_<index>` where it has none.
    pub name: String,
    /// The weight that it has where nothing animates it.
    pub rest: f32,
    /// What it drives.
    pub place: MorphPlace,
}

/// What a morph drives.
#[derive(Clone, Debug, PartialEq)]
pub enum MorphPlace {
    /// A morph target of the mesh of a node.
    Mesh {
        /// The node's index in the file.
        node: usize,
        /// The target's index in the mesh.
        index: usize,
        /// How many targets the mesh has; those of one node follow each other in [`super::Scene::morphs`].
        count: usize,
    },
    /// An expression: morphs of meshes (by their index in [`super::Scene::morphs`]) with the weight that each has at 1. None where the
    /// file animates a face that it does not hold.
    Expression(Vec<(usize, f32)>),
    /// A weight of its own: the file holds it without the mesh that it moves, as pose arrays do.
    Weight,
    /// No morph: a custom property, a number over time that moves nothing by itself.
    Property,
}

impl Morph {
    /// Whether it is a custom property and no morph.
    #[must_use]
    pub const fn is_property(&self) -> bool {
        matches!(self.place, MorphPlace::Property)
    }
}

/// The weight of one morph over the frames of a clip.
#[derive(Clone, Debug, PartialEq)]
pub struct MorphTrack {
    /// Index in [`super::Scene::morphs`].
    pub morph: usize,
    /// Its weights.
    pub weights: Track<f32>,
}

/// The vertices of a mesh with morph targets, in model space with the skeleton at rest and all weights at 0.
///
/// Made by a format's reader only: every number is finite, and there are as many displacements of each morph as positions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphMesh {
    /// Its first morph, as an index in [`super::Scene::morphs`]; the others follow.
    pub first: usize,
    /// Where its vertices are.
    pub positions: Vec<Vec3>,
    /// For each of its morphs, by how far it moves every vertex at weight 1.
    pub displacements: Vec<Vec<Vec3>>,
}
