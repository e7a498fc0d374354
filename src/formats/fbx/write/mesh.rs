//! The meshes of an FBX target, as its parser gives them: polygons, normals, UVs, colors, skins, shapes.
//!
//! Vertices are written in the space of their node, whatever pivots and geometric transforms lie between in the original. With `G` from
//! geometry to node and `B` from geometry to bone at the bind, a cluster's own transform is `B · G⁻¹`.

use std::collections::BTreeMap;

use glam::{DMat3, DMat4};

use crate::{
    formats::fbx::{
        FbxDocument,
        geometry::{corners, materials, matrix, normal_turn, vector},
    },
    model::{Canceled, Control, Skeleton},
};

use super::{
    binary::{Property, Record},
    materials::Materials,
    records::{connection, object},
};

/// Ids of what belongs to meshes count from here, above those of curves.
const FIRST_MESH_ID: i64 = 1 << 50;

/// Everything that belongs to meshes.
#[derive(Default)]
pub(super) struct Meshes {
    pub(super) objects: Vec<Record>,
    pub(super) connections: Vec<Record>,
    /// Joints that are the nodes of meshes.
    pub(super) nodes: Vec<usize>,
    /// `model_from_joint` in the bind pose, of the nodes of meshes and of the joints that they are bound to, in centimeters.
    pub(super) bind: BTreeMap<usize, DMat4>,
    /// Blend shapes by their index in the file, and the ids of what they are here: one for each mesh that they are on.
    pub(super) shapes: BTreeMap<usize, Vec<i64>>,
    pub(super) materials: Materials,
    /// How many objects there are of each kind, for the definitions.
    pub(super) geometries: i32,
    pub(super) deformers: i32,
    next_id: i64,
}

impl Meshes {
    /// Collects the meshes of a document. `node_id` gives the id of a joint's node.
    pub(super) fn new(
        document: &FbxDocument,
        skeleton: &Skeleton,
        centimeters: f64,
        node_id: impl Fn(usize) -> i64,
        control: &Control,
    ) -> Result<Self, Canceled> {
        let mut meshes = Self { next_id: FIRST_MESH_ID, ..Self::default() };
        for joint in 0..skeleton.len() {
            control.check()?;
            let node = document.nodes.node(&document.file, joint);
            let Some(mesh) = node.mesh.as_ref().filter(|mesh| !mesh.faces.is_empty()) else { continue };
            let instance =
                Instance { node, mesh, joint, node_from_geometry: matrix(&node.geometry_to_node), centimeters };
            meshes.nodes.push(joint);
            let geometry = meshes.add_geometry(&instance);
            meshes.connections.push(connection(geometry, node_id(joint)));
            for material in materials(instance.node, instance.mesh) {
                let id = meshes.materials.id_of(material);
                meshes.connections.push(connection(id, node_id(joint)));
            }
            for skin in &mesh.skin_deformers {
                meshes.add_skin(document, &instance, skin, geometry, &node_id);
            }
            for deformer in &mesh.blend_deformers {
                meshes.add_shapes(&instance, deformer, geometry);
            }
        }
        Ok(meshes)
    }

    /// Whether a joint is the node of a mesh.
    pub(super) fn is_node(&self, joint: usize) -> bool {
        self.nodes.binary_search(&joint).is_ok()
    }

    fn id(&mut self) -> i64 {
        self.next_id += 1;
        self.next_id
    }

    fn add_geometry(&mut self, instance: &Instance<'_>) -> i64 {
        let id = self.id();
        self.geometries += 1;
        self.objects.push(
            object("Geometry", id, &instance.mesh.element.name, "Mesh")
                .field("GeometryVersion", 124)
                .field("Vertices", Property::Numbers(instance.positions()))
                .field("PolygonVertexIndex", Property::Wholes(instance.polygons()))
                .holding(instance.layers()),
        );
        id
    }

    fn add_skin(
        &mut self,
        document: &FbxDocument,
        instance: &Instance<'_>,
        skin: &ufbx::SkinDeformer,
        geometry: i64,
        node_id: &impl Fn(usize) -> i64,
    ) {
        let id = self.id();
        self.deformers += 1;
        self.objects.push(
            object("Deformer", id, &skin.element.name, "Skin").field("Version", 101).field("Link_DeformAcuracy", 50.0),
        );
        self.connections.push(connection(id, geometry));
        for cluster in &skin.clusters {
            let Some(joint) = cluster.bone_node.as_ref().and_then(|node| document.nodes.joint(node)) else { continue };
            let in_geometry = |vertex: &u32| (*vertex as usize) < instance.mesh.vertices.len();
            let weights = cluster.vertices.iter().zip(cluster.weights.iter()).filter(|(vertex, _)| in_geometry(vertex));
            let (indices, weights): (Vec<i32>, Vec<f64>) =
                weights.map(|(vertex, weight)| (*vertex as i32, *weight)).unzip();
            let from_node = matrix(&cluster.geometry_to_bone) * instance.node_from_geometry.inverse();
            let bone_from_node = if from_node.is_finite() { from_node } else { matrix(&cluster.mesh_node_to_bone) };
            let bone_from_node = instance.scaled(bone_from_node);
            let model_from_bone = instance.scaled(matrix(&cluster.bind_to_world));
            self.bind.entry(joint).or_insert(model_from_bone);
            self.bind.entry(instance.joint).or_insert(model_from_bone * bone_from_node);
            let cluster_id = self.id();
            self.deformers += 1;
            let mut record = object("Deformer", cluster_id, &cluster.element.name, "Cluster")
                .field("Version", 100)
                .holding([Record::new("UserData").with("").with("")]);
            if !indices.is_empty() {
                record =
                    record.field("Indexes", Property::Wholes(indices)).field("Weights", Property::Numbers(weights));
            }
            self.objects.push(
                record.field("Transform", numbers(bone_from_node)).field("TransformLink", numbers(model_from_bone)),
            );
            self.connections.extend([connection(cluster_id, id), connection(node_id(joint), cluster_id)]);
        }
    }

    fn add_shapes(&mut self, instance: &Instance<'_>, deformer: &ufbx::BlendDeformer, geometry: i64) {
        let id = self.id();
        self.deformers += 1;
        self.objects.push(object("Deformer", id, &deformer.element.name, "BlendShape").field("Version", 100));
        self.connections.push(connection(id, geometry));
        for channel in &deformer.channels {
            let channel_id = self.id();
            self.deformers += 1;
            self.shapes.entry(channel.element.typed_id as usize).or_default().push(channel_id);
            let full: Vec<f64> = channel.keyframes.iter().map(|key| key.target_weight * 100.0).collect();
            self.objects.push(
                object("Deformer", channel_id, &channel.element.name, "BlendShapeChannel")
                    .field("Version", 100)
                    .field("DeformPercent", channel.weight * 100.0)
                    .field("FullWeights", Property::Numbers(full)),
            );
            self.connections.push(connection(channel_id, id));
            for key in channel.keyframes.iter() {
                let shape_id = self.id();
                self.geometries += 1;
                self.objects.push(instance.shape(shape_id, &key.shape));
                self.connections.push(connection(shape_id, channel_id));
            }
        }
    }
}

/// A mesh below one node.
struct Instance<'a> {
    node: &'a ufbx::Node,
    mesh: &'a ufbx::Mesh,
    joint: usize,
    node_from_geometry: DMat4,
    centimeters: f64,
}

impl Instance<'_> {
    /// A matrix between two spaces of the scene's unit, for spaces of centimeters.
    fn scaled(&self, matrix: DMat4) -> DMat4 {
        let mut matrix = matrix;
        matrix.w_axis = (matrix.w_axis.truncate() * self.centimeters).extend(1.0);
        matrix
    }

    fn positions(&self) -> Vec<f64> {
        let place =
            |position: &ufbx::Vec3| self.node_from_geometry.transform_point3(vector(position)) * self.centimeters;
        self.mesh.vertices.iter().flat_map(|position| place(position).to_array()).collect()
    }

    /// Vertices of all polygons, the last one of each as its complement.
    fn polygons(&self) -> Vec<i32> {
        let mut polygons = Vec::with_capacity(self.mesh.num_indices);
        for face in self.mesh.faces.iter() {
            let corners = corners(face);
            let last = corners.end.saturating_sub(1);
            polygons.extend(corners.map(|corner| {
                let vertex = self.mesh.vertex_indices[corner] as i32;
                if corner == last { !vertex } else { vertex }
            }));
        }
        polygons
    }

    /// What corners have beside their place, in the order of the polygons.
    fn per_corner<T: Copy>(&self, indices: &ufbx::List<u32>, of: impl Fn(usize) -> T) -> Vec<T> {
        self.mesh.faces.iter().flat_map(corners).map(|corner| of(indices[corner] as usize)).collect()
    }

    fn indices(&self, indices: &ufbx::List<u32>) -> Property {
        Property::Wholes(self.per_corner(indices, |index| index as i32))
    }

    fn layers(&self) -> Vec<Record> {
        let mesh = self.mesh;
        let mut elements = Vec::new();
        let mut layers: Vec<Vec<(&'static str, i32)>> = vec![Vec::new()];
        let mut on_layer = |index: usize, kind: &'static str| {
            layers.resize_with(layers.len().max(index + 1), Vec::new);
            layers[index].push((kind, index as i32));
        };
        if mesh.vertex_normal.exists {
            let turn = normal_turn(&self.node_from_geometry);
            let normal =
                |index: usize| (turn * vector(&mesh.vertex_normal.values[index])).normalize_or_zero().to_array();
            let normals = self.per_corner(&mesh.vertex_normal.indices, normal).into_flattened();
            elements.push(layer("LayerElementNormal", 0, "", "Direct").field("Normals", Property::Numbers(normals)));
            on_layer(0, "LayerElementNormal");
        }
        for (index, set) in mesh.uv_sets.iter().enumerate().filter(|(_, set)| set.vertex_uv.exists) {
            let values = set.vertex_uv.values.iter().flat_map(|uv| [uv.x, uv.y]).collect();
            let indices = self.indices(&set.vertex_uv.indices);
            let element = layer("LayerElementUV", index, &set.name, "IndexToDirect");
            elements.push(element.field("UV", Property::Numbers(values)).field("UVIndex", indices));
            on_layer(index, "LayerElementUV");
        }
        for (index, set) in mesh.color_sets.iter().enumerate().filter(|(_, set)| set.vertex_color.exists) {
            let values =
                set.vertex_color.values.iter().flat_map(|color| [color.x, color.y, color.z, color.w]).collect();
            let indices = self.indices(&set.vertex_color.indices);
            let element = layer("LayerElementColor", index, &set.name, "IndexToDirect");
            elements.push(element.field("Colors", Property::Numbers(values)).field("ColorIndex", indices));
            on_layer(index, "LayerElementColor");
        }
        if materials(self.node, self.mesh).next().is_some() {
            let of_faces = mesh.face_material.iter().map(|material| *material as i32);
            let (mapping, of_faces) =
                if mesh.face_material.is_empty() { ("AllSame", vec![0]) } else { ("ByPolygon", of_faces.collect()) };
            elements.push(
                Record::new("LayerElementMaterial")
                    .with(0)
                    .field("Version", 101)
                    .field("Name", "")
                    .field("MappingInformationType", mapping)
                    .field("ReferenceInformationType", "IndexToDirect")
                    .field("Materials", Property::Wholes(of_faces)),
            );
            on_layer(0, "LayerElementMaterial");
        }
        elements.extend(layers.into_iter().enumerate().map(|(index, kinds)| {
            let element = |(kind, typed_index)| {
                Record::new("LayerElement").field("Type", kind).field("TypedIndex", Property::Whole(typed_index))
            };
            Record::new("Layer").with(index as i32).field("Version", 100).holding(kinds.into_iter().map(element))
        }));
        elements
    }

    fn shape(&self, id: i64, shape: &ufbx::BlendShape) -> Record {
        let turn = DMat3::from_mat4(self.node_from_geometry);
        let offset = |offset: &ufbx::Vec3| (turn * vector(offset) * self.centimeters).to_array();
        let vertices: Vec<i32> = shape.offset_vertices.iter().map(|vertex| *vertex as i32).collect();
        let offsets: Vec<f64> = shape.position_offsets.iter().flat_map(offset).collect();
        let normal_turn = normal_turn(&self.node_from_geometry);
        let normals: Vec<f64> =
            shape.normal_offsets.iter().flat_map(|normal| (normal_turn * vector(normal)).to_array()).collect();
        let record = object("Geometry", id, &shape.element.name, "Shape")
            .field("Version", 100)
            .field("Indexes", Property::Wholes(vertices))
            .field("Vertices", Property::Numbers(offsets));
        if normals.is_empty() { record } else { record.field("Normals", Property::Numbers(normals)) }
    }
}

fn layer(kind: &'static str, index: usize, name: &str, reference: &str) -> Record {
    Record::new(kind)
        .with(index as i32)
        .field("Version", 101)
        .field("Name", name)
        .field("MappingInformationType", "ByPolygonVertex")
        .field("ReferenceInformationType", reference)
}

fn numbers(matrix: DMat4) -> Property {
    Property::Numbers(matrix.to_cols_array().to_vec())
}
