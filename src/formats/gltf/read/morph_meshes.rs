//! The vertices of meshes with morph targets, and where those move them.

use std::collections::BTreeMap;

use glam::{DMat4, Vec3, Vec4};

use super::accessor::{Accessors, Shape};
use crate::{
    formats::{Budget, FormatError, gltf::document::Document, gltf::json::Cursor},
    model::{ModelPose, MorphMesh, MorphPlace, Scene, Transform},
};

/// See [`crate::formats::morph_meshes`].
pub(in crate::formats) fn morph_meshes(scene: &Scene, budget: &mut Budget<'_>) -> Result<Vec<MorphMesh>, FormatError> {
    let Some(document) = scene.payload.get::<Document>() else { return Ok(Vec::new()) };
    let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
    let root = document.root();
    let (Some(nodes), Some(meshes)) = (root.get("nodes")?, root.get("meshes")?) else { return Ok(Vec::new()) };
    let mesh_count = meshes.length()?;
    let mut reader = MeshReader { accessors: Accessors::new(document), scene, rest };
    let mut found = Vec::new();
    for (first, morph) in scene.morphs.iter().enumerate() {
        let MorphPlace::Mesh { node: index, index: 0, count } = morph.place else { continue };
        budget.check_canceled()?;
        let node = nodes.element(index)?;
        let Some(mesh) = node.get("mesh")? else { continue };
        let mesh = meshes.element(mesh.index(mesh_count, "meshes")?)?;
        let model_from_mesh = reader.model_from_mesh(index, &node, &mesh, budget)?;
        found.push(reader.mesh(&mesh, &model_from_mesh, first, count, budget)?);
    }
    Ok(found)
}

struct MeshReader<'d> {
    accessors: Accessors<'d>,
    scene: &'d Scene,
    rest: ModelPose,
}

impl MeshReader<'_> {
    fn mesh(
        &mut self,
        mesh: &Cursor<'_, '_>,
        model_from_mesh: &DMat4,
        first: usize,
        count: usize,
        budget: &mut Budget<'_>,
    ) -> Result<MorphMesh, FormatError> {
        let mut result = MorphMesh { first, positions: Vec::new(), displacements: vec![Vec::new(); count] };
        let mut seen = Vec::new();
        let primitives = mesh.require("primitives")?;
        for primitive in primitives.elements()? {
            let attributes = primitive.require("attributes")?;
            let place = attributes.require("POSITION")?;
            let accessor = self.accessors.accessor(&place)?;
            // Primitives of several materials often share their vertices.
            if seen.contains(&accessor.index) {
                continue;
            }
            seen.push(accessor.index);
            accessor.expect(Shape::Vec3, false, &place)?;
            let positions: Vec<Vec3> = self.accessors.decode(&accessor, accessor.count, &place, budget)?;
            let vertices = positions.len();
            let moved_count = result.displacements.len() as u64 * vertices as u64;
            budget.take_array(moved_count, size_of::<Vec3>() as u64, "/meshes")?;
            result.positions.extend(
                positions.iter().map(|position| model_from_mesh.transform_point3(position.as_dvec3()).as_vec3()),
            );
            let targets = primitive.get("targets")?;
            let target_count = targets.as_ref().map_or(Ok(0), Cursor::length)?;
            for (index, displacements) in result.displacements.iter_mut().enumerate() {
                displacements.resize(displacements.len() + vertices, Vec3::ZERO);
                let Some(targets) = targets.as_ref().filter(|_| index < target_count) else { continue };
                let target = targets.element(index)?;
                let Some(place) = target.get("POSITION")? else { continue };
                let accessor = self.accessors.accessor(&place)?;
                accessor.expect(Shape::Vec3, false, &place)?;
                let moved: Vec<Vec3> = self.accessors.decode(&accessor, vertices, &place, budget)?;
                let begin = displacements.len() - vertices;
                for (displacement, moved) in displacements[begin..].iter_mut().zip(moved) {
                    *displacement = model_from_mesh.transform_vector3(moved.as_dvec3()).as_vec3();
                }
            }
        }
        let is_finite = |values: &[Vec3]| values.iter().all(|value| value.is_finite());
        if !is_finite(&result.positions) || !result.displacements.iter().all(|values| is_finite(values)) {
            return Err(mesh.malformed("a vertex is not a finite number"));
        }
        Ok(result)
    }

    /// Where the mesh is with the skeleton at rest: as the joint that moves most of it carries it, else as its node does.
    fn model_from_mesh(
        &mut self,
        index: usize,
        node: &Cursor<'_, '_>,
        mesh: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<DMat4, FormatError> {
        let matrix = |transform: &Transform| {
            DMat4::from_scale_rotation_translation(transform.scale, transform.rotation, transform.translation)
        };
        let joint = match node.get("skin")? {
            Some(skin) => {
                let skin = skin.index(self.scene.skins.len(), "skins")?;
                self.heaviest_joint(skin, mesh, budget)?
            }
            None => None,
        };
        if let Some((joint, bind)) = joint.and_then(|joint| Some((joint, self.scene.bind_pose.get(joint)?.as_ref()?))) {
            return Ok(matrix(&self.rest.transforms()[joint]) * matrix(bind).inverse());
        }
        let joint = self.scene.skeleton.joints().iter().position(|joint| joint.node == index);
        Ok(joint.map_or(DMat4::IDENTITY, |joint| matrix(&self.rest.transforms()[joint])))
    }

    fn heaviest_joint(
        &mut self,
        skin: usize,
        mesh: &Cursor<'_, '_>,
        budget: &mut Budget<'_>,
    ) -> Result<Option<usize>, FormatError> {
        let joints = &self.scene.skins[skin].joints;
        let mut weight_of: BTreeMap<usize, f64> = BTreeMap::new();
        let primitives = mesh.require("primitives")?;
        let Some(primitive) = primitives.elements()?.next() else { return Ok(None) };
        let attributes = primitive.require("attributes")?;
        let (Some(slots), Some(weights)) = (attributes.get("JOINTS_0")?, attributes.get("WEIGHTS_0")?) else {
            return Ok(None);
        };
        let (slots, weights) = (self.accessors.accessor(&slots)?, self.accessors.accessor(&weights)?);
        slots.expect(Shape::Vec4, false, &attributes)?;
        weights.expect(Shape::Vec4, false, &attributes)?;
        let count = slots.count.min(weights.count);
        let slots: Vec<Vec4> = self.accessors.decode(&slots, count, &attributes, budget)?;
        let weights: Vec<Vec4> = self.accessors.decode(&weights, count, &attributes, budget)?;
        for (slots, weights) in slots.iter().zip(&weights) {
            for (slot, weight) in slots.to_array().into_iter().zip(weights.to_array()) {
                // It was an integer.
                if let Some(joint) = joints.get(slot as usize).filter(|_| weight > 0.0) {
                    *weight_of.entry(*joint).or_default() += f64::from(weight);
                }
            }
        }
        Ok(weight_of.into_iter().max_by(|one, other| one.1.total_cmp(&other.1)).map(|(joint, _)| joint))
    }
}
