//! The samples as GLB, written directly: they must not depend on the reader and the writer that they help to test.

use serde_json::{Value, json};

use crate::model::{Clip, Skeleton};

use super::{capsules::Mesh, figure::Figure};

const FLOAT: u32 = 5126;
const UNSIGNED_BYTE: u32 = 5121;
const UNSIGNED_SHORT: u32 = 5123;
const ARRAY_BUFFER: u32 = 34962;
const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// A glTF document under construction: one node per joint, in the figure's order, then perhaps a node with a mesh.
pub(super) struct Document<'a> {
    figure: &'a Figure,
    skeleton: Skeleton,
    nodes: Vec<Value>,
    roots: Vec<usize>,
    views: Vec<Value>,
    accessors: Vec<Value>,
    binary: Vec<u8>,
    members: serde_json::Map<String, Value>,
}

impl<'a> Document<'a> {
    pub(super) fn new(figure: &'a Figure) -> Self {
        let skeleton = figure.skeleton();
        let children = skeleton.children();
        let node = |(index, joint): (usize, &crate::model::Joint)| {
            let translation = joint.rest.translation.as_vec3().to_array();
            let rotation = joint.rest.rotation.as_quat().normalize().to_array();
            let mut node = json!({"name": joint.name, "translation": translation, "rotation": rotation});
            if !children[index].is_empty() {
                node["children"] = json!(children[index]);
            }
            node
        };
        let nodes = skeleton.joints().iter().enumerate().map(node).collect();
        let roots = (0..skeleton.len()).filter(|joint| skeleton.parent(*joint).is_none()).collect();
        Self {
            figure,
            skeleton,
            nodes,
            roots,
            views: Vec::new(),
            accessors: Vec::new(),
            binary: Vec::new(),
            members: serde_json::Map::new(),
        }
    }

    /// Says that the nodes are joints.
    pub(super) fn with_skin(mut self, name: &str) -> Self {
        let inverse = |model: &crate::model::Transform| {
            let mut matrix = model.to_matrix().inverse().as_mat4().to_cols_array_2d();
            // Rounding must not touch the row that makes the matrix affine.
            for (column, last) in matrix.iter_mut().zip([0.0, 0.0, 0.0, 1.0]) {
                column[3] = last;
            }
            matrix
        };
        let matrices: Vec<[[f32; 4]; 4]> = self.figure.rest().transforms().iter().map(inverse).collect();
        let accessor = self.add(bytemuck::cast_slice(&matrices), matrices.len(), FLOAT, "MAT4", None);
        let joints: Vec<usize> = (0..self.figure.len()).collect();
        self.members.insert(
            "skins".into(),
            json!([{"name": name, "joints": joints, "skeleton": self.roots[0], "inverseBindMatrices": accessor}]),
        );
        self
    }

    /// Adds a mesh bound to the skin.
    pub(super) fn with_mesh(mut self, name: &str, mesh: &Mesh) -> Self {
        let count = mesh.positions.len();
        let (least, most) = bounds(&mesh.positions);
        let position = self.add(bytemuck::cast_slice(&mesh.positions), count, FLOAT, "VEC3", Some(ARRAY_BUFFER));
        self.accessors[position]["min"] = json!(least);
        self.accessors[position]["max"] = json!(most);
        let normal = self.add(bytemuck::cast_slice(&mesh.normals), count, FLOAT, "VEC3", Some(ARRAY_BUFFER));
        let joints = self.add(bytemuck::cast_slice(&mesh.joints), count, UNSIGNED_BYTE, "VEC4", Some(ARRAY_BUFFER));
        let weights = self.add(bytemuck::cast_slice(&mesh.weights), count, UNSIGNED_BYTE, "VEC4", Some(ARRAY_BUFFER));
        self.accessors[weights]["normalized"] = json!(true);
        let indices = bytemuck::cast_slice(&mesh.indices);
        let indices = self.add(indices, mesh.indices.len(), UNSIGNED_SHORT, "SCALAR", Some(ELEMENT_ARRAY_BUFFER));
        self.members.insert(
            "meshes".into(),
            json!([{"name": name, "primitives": [{
                "attributes": {"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights},
                "indices": indices,
                "material": 0,
            }]}]),
        );
        self.members.insert(
            "materials".into(),
            json!([{"name": "Clay", "pbrMetallicRoughness": {
                "baseColorFactor": [0.62, 0.66, 0.72, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.75,
            }}]),
        );
        self.roots.push(self.nodes.len());
        self.nodes.push(json!({"name": name, "mesh": 0, "skin": 0}));
        self
    }

    /// Adds an animation of the joints.
    pub(super) fn with_clip(mut self, clip: &Clip) -> Self {
        let times: Vec<f32> = clip.times_seconds().iter().map(|time| *time as f32).collect();
        let input = self.add(bytemuck::cast_slice(&times), times.len(), FLOAT, "SCALAR", None);
        self.accessors[input]["min"] = json!([times[0]]);
        self.accessors[input]["max"] = json!([times[times.len() - 1]]);
        let (mut channels, mut samplers) = (Vec::new(), Vec::new());
        for (index, tracks) in clip.joints().iter().enumerate() {
            let rest = self.skeleton.joints()[index].rest;
            if tracks.translation.is_animated() {
                let values: Vec<[f32; 3]> = (0..times.len())
                    .map(|frame| tracks.translation.at(frame, rest.translation.as_vec3()).to_array())
                    .collect();
                let output = self.add(bytemuck::cast_slice(&values), values.len(), FLOAT, "VEC3", None);
                channels.push(json!({"sampler": samplers.len(), "target": {"node": index, "path": "translation"}}));
                samplers.push(json!({"input": input, "output": output}));
            }
            if tracks.rotation.is_animated() {
                let values: Vec<[f32; 4]> = (0..times.len())
                    .map(|frame| tracks.rotation.at(frame, rest.rotation.as_quat()).to_array())
                    .collect();
                let output = self.add(bytemuck::cast_slice(&values), values.len(), FLOAT, "VEC4", None);
                channels.push(json!({"sampler": samplers.len(), "target": {"node": index, "path": "rotation"}}));
                samplers.push(json!({"input": input, "output": output}));
            }
        }
        self.members
            .insert("animations".into(), json!([{"name": clip.name(), "channels": channels, "samplers": samplers}]));
        self
    }

    /// Joins JSON and binary chunk.
    pub(super) fn into_glb(self) -> Vec<u8> {
        let mut document = json!({
            "asset": {"version": "2.0", "generator": "retargetd samples"},
            "scene": 0,
            "scenes": [{"nodes": self.roots}],
            "nodes": self.nodes,
            "bufferViews": self.views,
            "accessors": self.accessors,
            "buffers": [{"byteLength": self.binary.len()}],
        });
        for (member, value) in self.members {
            document[member] = value;
        }
        let mut text = document.to_string().into_bytes();
        text.resize(text.len().next_multiple_of(4), b' ');
        let total = 12 + 8 + text.len() + 8 + self.binary.len();
        let mut glb = Vec::with_capacity(total);
        glb.extend_from_slice(b"glTF");
        for number in [2, total as u32, text.len() as u32] {
            glb.extend_from_slice(&number.to_le_bytes());
        }
        glb.extend_from_slice(b"JSON");
        glb.extend_from_slice(&text);
        glb.extend_from_slice(&(self.binary.len() as u32).to_le_bytes());
        glb.extend_from_slice(b"BIN\0");
        glb.extend_from_slice(&self.binary);
        glb
    }

    /// Adds an accessor with a view of its own; gives its index.
    fn add(&mut self, bytes: &[u8], count: usize, component: u32, kind: &str, usage: Option<u32>) -> usize {
        let mut view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        if let Some(usage) = usage {
            view["target"] = json!(usage);
        }
        self.binary.extend_from_slice(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.accessors
            .push(json!({"bufferView": self.views.len(), "componentType": component, "count": count, "type": kind}));
        self.views.push(view);
        self.accessors.len() - 1
    }
}

fn bounds(positions: &[[f32; 3]]) -> ([f32; 3], [f32; 3]) {
    let mut least = [f32::INFINITY; 3];
    let mut most = [f32::NEG_INFINITY; 3];
    for position in positions {
        for axis in 0..3 {
            least[axis] = least[axis].min(position[axis]);
            most[axis] = most[axis].max(position[axis]);
        }
    }
    (least, most)
}
