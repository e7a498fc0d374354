//! A drawing as a skin on bones, for formats that hold those: which bones carry each vertex, and by what share.

use glam::DVec2;

use crate::picture::Picture;

use super::bones::{BoneMesh, Share};

/// A drawing as a skin on bones.
#[derive(Clone, Debug)]
pub struct Skin<'a> {
    pub(super) mesh: &'a BoneMesh,
    /// For each vertex its place at rest.
    pub vertices: &'a [DVec2],
    /// For each vertex its place on the texture, in pixels.
    pub texels: &'a [DVec2],
    /// What the mask leaves out has no opacity.
    pub texture: &'a Picture,
    /// For each body part group its triangles, in the order of drawing.
    pub parts: Vec<Vec<[usize; 3]>>,
}

impl Skin<'_> {
    /// For each bone the joint at its end and the joint that it begins at.
    #[must_use]
    pub fn bones(&self) -> Vec<[usize; 2]> {
        self.mesh.bones().iter().map(|bone| [bone.joint, bone.from]).collect()
    }

    /// For each vertex the bones that carry it, with shares that add up to 1; four at most.
    #[must_use]
    pub fn shares(&self) -> &[Vec<Share>] {
        self.mesh.shares()
    }

    /// Whether a vertex is one bone's alone, so that what is around it keeps its shape.
    #[must_use]
    pub fn is_firm(&self, vertex: usize) -> bool {
        self.mesh.is_firm(vertex)
    }

    /// Where the vertices are when bones carry them to joints that are there.
    #[must_use]
    pub fn placed(&self, joints: &[DVec2]) -> Vec<DVec2> {
        let poses = self.mesh.poses(joints);
        self.vertices.iter().enumerate().map(|(vertex, &at)| self.mesh.carried(vertex, at, &poses)).collect()
    }

    /// For each bone the angle by which it is turned from rest, when the joints are there.
    #[must_use]
    pub fn turns(&self, joints: &[DVec2]) -> Vec<f64> {
        self.mesh.poses(joints).iter().map(|pose| pose.turn.angle()).collect()
    }

    /// For each bone how long it is, in lengths at rest, when the joints are there.
    #[must_use]
    pub fn stretches(&self, joints: &[DVec2]) -> Vec<f64> {
        self.mesh.poses(joints).iter().map(|pose| pose.stretch).collect()
    }
}
