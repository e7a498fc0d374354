//! The meshes of a file for the writers of other formats: triangles with skins, shapes and plain materials.
//!
//! A mesh that is bound to joints is taken to where it was bound, so that all skins of a figure are bound in one space: with `W` from
//! geometry to world at the bind and `B` from geometry to bone, `joint_from_vertex` is `B · W⁻¹`.

mod binding;
mod corners;
mod lost;
mod materials;
mod shapes;

use std::collections::BTreeMap;

use glam::{DMat4, DVec3, Vec3};

use crate::{
    formats::meshes::{Mesh, Meshes, Part},
    model::{Canceled, Control, ModelPose, Reporter, Scene},
};

use super::{
    FbxDocument,
    geometry::{self, matrix, normal_turn, vector},
};
use corners::Corners;
use lost::Lost;
use materials::Materials;

/// What all meshes together may take, in bytes. A file that was read under a limit can say the same thing many times over.
const MAX_BYTES: u64 = 1 << 30;

/// The meshes of a target that came from FBX; nothing where it has none, or they would be too large, which is reported.
///
/// # Errors
/// When the work is canceled.
pub(in crate::formats) fn meshes<'a>(
    target: &'a Scene,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Option<Meshes<'a>>, Canceled> {
    let Some(document) = target.payload.get::<FbxDocument>() else {
        if !target.skins.is_empty() {
            reporter.warn(
                "fbx_meshes_sheared",
                "Objects",
                "the file shears its joints, and what moves instead is not what its meshes are bound to, so they were left out",
                "apply the scale of the armature before exporting",
            );
        }
        return Ok(None);
    };
    let morph = |morph| Some((document.properties.shape(morph)?, morph));
    let mut work = Work {
        document,
        target,
        rest: target.skeleton.rest_pose().to_model(&target.skeleton),
        morph_of_shape: (0..target.morphs.len()).filter_map(morph).collect(),
        left: MAX_BYTES,
        lost: Lost::default(),
    };
    let mut materials = Materials::default();
    let mut all: Vec<Mesh> = Vec::new();
    // A mesh that several nodes wear alike is there once.
    let mut worn: BTreeMap<(u32, Vec<u32>, [u64; 16]), usize> = BTreeMap::new();
    for joint in 0..target.skeleton.len() {
        control.check()?;
        let node = document.nodes.node(&document.file, joint);
        let Some(mesh) = node.mesh.as_ref().filter(|mesh| !mesh.faces.is_empty()) else { continue };
        if !node.visible {
            work.lost.hidden(&node.element.name);
            continue;
        }
        let painted = geometry::materials(node, mesh).map(|material| material.element.element_id).collect();
        let place = matrix(&node.geometry_to_node).to_cols_array().map(f64::to_bits);
        let place = if mesh.skin_deformers.is_empty() { place } else { [joint as u64; 16] };
        let key = (mesh.element.element_id, painted, place);
        if let Some(index) = worn.get(&key) {
            all[*index].nodes.push(joint);
            continue;
        }
        match work.mesh(joint, node, mesh, &mut materials) {
            Ok(Some(mesh)) => {
                worn.insert(key, all.len());
                all.push(mesh);
            }
            Ok(None) => work.lost.broken(&node.element.name),
            Err(TooLarge) => {
                reporter.warn(
                    "fbx_meshes_too_large",
                    "",
                    format!("the meshes take more than {} MiB as triangles, so they were left out", MAX_BYTES >> 20),
                    "ask for fbx, or load the animation onto the character in the program that has it",
                );
                return Ok(None);
            }
        }
    }
    let (materials, images) = materials.finish(&mut work.lost);
    work.lost.report(reporter);
    Ok((!all.is_empty()).then_some(Meshes { meshes: all, materials, images }))
}

/// The meshes would take more than they may.
struct TooLarge;

/// What making meshes needs and counts.
struct Work<'a> {
    document: &'a FbxDocument,
    target: &'a Scene,
    /// Where the joints are at rest.
    rest: ModelPose,
    /// Which of the scene's morphs a blend shape of the file is.
    morph_of_shape: BTreeMap<usize, usize>,
    /// Bytes that may still be taken.
    left: u64,
    lost: Lost,
}

impl<'a> Work<'a> {
    /// To be asked before anything is allocated.
    fn take(&mut self, count: usize, bytes_each: usize) -> Result<(), TooLarge> {
        let bytes = (count as u64).saturating_mul(bytes_each as u64);
        self.left = self.left.checked_sub(bytes).ok_or(TooLarge)?;
        Ok(())
    }

    /// The mesh of one node; nothing where it has no triangle, or numbers that are none.
    fn mesh(
        &mut self,
        joint: usize,
        node: &'a ufbx::Node,
        mesh: &'a ufbx::Mesh,
        materials: &mut Materials<'a>,
    ) -> Result<Option<Mesh>, TooLarge> {
        if !mesh.vertices.iter().all(|position| vector(position).is_finite()) {
            return Ok(None);
        }
        let skin =
            mesh.skin_deformers.iter().next().and_then(|skin| Some((skin, binding::space(self.document, skin)?)));
        let place = skin.as_ref().map_or_else(|| matrix(&node.geometry_to_node), |(_, space)| *space);
        let corners = Corners::new(self, mesh, &normal_turn(&place))?;
        let vertices = corners.vertices();
        let position = |vertex: &u32| mesh.vertices.as_ref().get(*vertex as usize).map_or(DVec3::NAN, vector);
        let positions: Vec<Vec3> =
            vertices.iter().map(|vertex| place.transform_point3(position(vertex)).as_vec3()).collect();
        let parts = parts(&corners, node, mesh, place.determinant() < 0.0, materials);
        if parts.is_empty() || !positions.iter().all(|position| position.is_finite()) {
            return Ok(None);
        }
        let binding = match &skin {
            Some((skin, space)) => binding::binding(self, (joint, node, mesh), skin, space, vertices)?,
            None => None,
        };
        let shapes = shapes::shapes(self, mesh, &place, vertices)?;
        if !mesh.color_sets.is_empty() {
            self.lost.note("colors of vertices", &node.element.name);
        }
        let name = if node.element.name.is_empty() { &mesh.element.name } else { &node.element.name };
        let (normals, uv_sets) = (corners.normals(), corners.uv_sets());
        Ok(Some(Mesh {
            name: name.to_string(),
            nodes: vec![joint],
            positions,
            normals,
            uv_sets,
            parts,
            binding,
            shapes,
        }))
    }
}

/// Triangles by material, in the order of the file; with all sides turned about where the space is mirrored.
fn parts<'a>(
    corners: &Corners<'_>,
    node: &'a ufbx::Node,
    mesh: &'a ufbx::Mesh,
    is_mirrored: bool,
    materials: &mut Materials<'a>,
) -> Vec<Part> {
    let of_node: Vec<&ufbx::Material> = geometry::materials(node, mesh).collect();
    let mut parts: BTreeMap<usize, Vec<u32>> = BTreeMap::new();
    let uv_sets: Vec<&str> = mesh.uv_sets.iter().filter(|set| set.vertex_uv.exists).map(|set| &*set.name).collect();
    for (face, triangle) in corners.triangles() {
        let material = mesh.face_material.as_ref().get(face).map_or(0, |material| *material as usize);
        let [one, two, three] = triangle;
        parts.entry(material).or_default().extend(if is_mirrored { [one, three, two] } else { [one, two, three] });
    }
    let part = |(material, indices): (usize, Vec<u32>)| Part {
        material: of_node.get(material).map(|material| materials.index_of(material, &uv_sets)),
        indices,
    };
    parts.into_iter().map(part).collect()
}

/// Whether a matrix can be inverted.
fn is_solid(matrix: &DMat4) -> bool {
    matrix.is_finite() && matrix.inverse().is_finite()
}
