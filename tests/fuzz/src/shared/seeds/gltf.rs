//! glTF documents with what readers treat on its own.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use super::super::container::{Part, glb};

const BYTE: u32 = 5120;
const SHORT: u32 = 5122;
const WIDER: u32 = 5123;
const FLOAT: u32 = 5126;

/// A document and its one buffer.
pub(super) struct Document {
    json: Value,
    binary: Vec<u8>,
}

impl Document {
    fn new(nodes: Value) -> Self {
        let json = json!({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": nodes, "bufferViews": [],
                          "accessors": [], "animations": []});
        Self { json, binary: Vec::new() }
    }

    fn view(&mut self, bytes: &[u8]) -> usize {
        let view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        self.binary.extend(bytes);
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        self.push("bufferViews", view)
    }

    fn floats(&mut self, shape: &str, values: &[f32]) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(shape, FLOAT, values.len() / width, &bytes, json!({}))
    }

    fn accessor(&mut self, shape: &str, component: u32, count: usize, bytes: &[u8], more: Value) -> usize {
        let view = self.view(bytes);
        let mut accessor = json!({"bufferView": view, "componentType": component, "count": count, "type": shape});
        if let (Value::Object(members), Value::Object(more)) = (&mut accessor, more) {
            members.extend(more);
        }
        self.push("accessors", accessor)
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let Value::Array(values) = &mut self.json[list] else { return 0 };
        values.push(value);
        values.len() - 1
    }

    fn animation(&mut self, channels: &[(Value, usize, usize, &str)]) {
        let samplers: Vec<Value> = channels
            .iter()
            .map(|(_, input, output, interpolation)| json!({"input": input, "output": output, "interpolation": interpolation}))
            .collect();
        let channels: Vec<Value> = channels
            .iter()
            .enumerate()
            .map(|(sampler, (target, ..))| json!({"sampler": sampler, "target": target}))
            .collect();
        self.push("animations", json!({"name": "clip", "channels": channels, "samplers": samplers}));
    }

    pub(super) fn into_json(mut self) -> Vec<u8> {
        let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.binary));
        self.json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": uri}]);
        self.json.to_string().into_bytes()
    }

    pub(super) fn into_glb(mut self) -> Vec<u8> {
        self.json["buffers"] = json!([{"byteLength": self.binary.len()}]);
        glb(&[Part::new("JSON", self.json.to_string().as_bytes()), Part::new("BIN\0", &self.binary)])
    }

    /// The document, and beside it the buffer that it names.
    pub(super) fn into_two(mut self, name: &str) -> (Vec<u8>, Vec<u8>) {
        self.json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": name}]);
        self.json["images"] = json!([{"uri": "b.png"}, {"uri": "missing.png"}]);
        (self.json.to_string().into_bytes(), self.binary)
    }
}

pub(super) fn documents() -> Vec<(String, Document)> {
    [("features", features()), ("stretched", stretched()), ("vrm_1", vrm(true)), ("vrm_0", vrm(false))]
        .map(|(name, document)| (name.to_owned(), document))
        .into()
}

/// Skins, shapes and every kind of track and accessor.
pub(super) fn features() -> Document {
    let matrix: [f32; 16] = std::array::from_fn(|index| if index % 5 == 0 { 1.0 } else { 0.0 });
    let mut document = Document::new(json!([
        {"name": "hips", "children": [1, 2], "translation": [0, 0.9, 0]},
        {"name": "spine", "children": [3], "matrix": matrix.map(f64::from)},
        {"name": "body", "mesh": 0, "skin": 0, "weights": [0.5]},
        {"name": "head", "rotation": [0, 0.6, 0, 0.8], "scale": [1, 1, 1], "extras": {"kept": 1}}
    ]));
    let times = document.floats("SCALAR", &[0.0, 0.5, 1.0]);
    let places = document.floats("VEC3", &[0.0, 0.9, 0.0, 0.0, 1.0, 0.0, 0.1, 0.9, 0.0]);
    let cubic: Vec<f32> = (0..9).flat_map(|key| [0.0, 0.0, 0.1, if key % 3 == 1 { 1.0 } else { 0.0 }]).collect();
    let cubic = document.floats("VEC4", &cubic);
    let small: Vec<u8> = [[0_i16, 0, 0, i16::MAX], [0, i16::MAX, 0, 0], [0, 0, 0, i16::MIN]]
        .concat()
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    let small = document.accessor("VEC4", SHORT, 3, &small, json!({"normalized": true}));
    let weights = document.accessor("SCALAR", BYTE + 1, 3, &[0, 128, 255], json!({"normalized": true}));
    let (indices, values) = (document.view(&[1]), document.view(&[0; 12]));
    let sparse = json!({"count": 3, "componentType": FLOAT, "type": "VEC3", "sparse": {"count": 1,
        "indices": {"bufferView": indices, "componentType": BYTE + 1}, "values": {"bufferView": values}}});
    let sparse = document.push("accessors", sparse);
    document.animation(&[
        (json!({"node": 0, "path": "translation"}), times, places, "LINEAR"),
        (json!({"node": 1, "path": "rotation"}), times, cubic, "CUBICSPLINE"),
        (json!({"node": 3, "path": "rotation"}), times, small, "STEP"),
        (json!({"node": 3, "path": "scale"}), times, sparse, "LINEAR"),
        (json!({"node": 2, "path": "weights"}), times, weights, "LINEAR"),
        (
            json!({"path": "pointer", "extensions": {"KHR_animation_pointer": {"pointer": "/materials/0/emissiveFactor"}}}),
            times,
            places,
            "LINEAR",
        ),
    ]);
    let binds = document.floats("MAT4", &[matrix, matrix].concat());
    let points: Vec<u8> = (0..9_i16).flat_map(|value| [value.to_le_bytes(), [0; 2]].concat()).take(24).collect();
    let points = document.view(&points);
    document.json["bufferViews"][points]["byteStride"] = json!(8);
    let points = json!({"bufferView": points, "componentType": SHORT, "normalized": true, "count": 3, "type": "VEC3"});
    let points = document.push("accessors", points);
    let shape = document.floats("VEC3", &[0.0; 9]);
    let joints = document.accessor("VEC4", WIDER, 3, &[0; 24], json!({}));
    let shares = document.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
    document.json["skins"] =
        json!([{"joints": [0, 1], "inverseBindMatrices": binds, "skeleton": 0}, {"joints": [3, 1]}]);
    document.json["meshes"] = json!([{"primitives": [{"attributes": {"POSITION": points, "JOINTS_0": joints, "WEIGHTS_0": shares},
        "targets": [{"POSITION": shape}]}], "extras": {"targetNames": ["smile"]}, "weights": [0.1]}]);
    document.json["materials"] = json!([{"emissiveFactor": [0, 0, 0]}]);
    document.json["extensionsUsed"] = json!(["KHR_animation_pointer", "KHR_mesh_quantization"]);
    document
}

/// Joints below a scale that differs by axis, a second scene, a node that nothing holds.
fn stretched() -> Document {
    let mut document = Document::new(json!([
        {"name": "armature", "scale": [1, 2, 0.5], "children": [1]},
        {"name": "#1", "rotation": [0.3826834, 0, 0, 0.9238795], "children": [2]},
        {"name": "#1", "translation": [0, 1, 0]},
        {"camera": 0}
    ]));
    document.json["scenes"] = json!([{"nodes": [0]}, {"nodes": [3, 0]}]);
    document.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 1, "znear": 0.1}}]);
    let times = document.floats("SCALAR", &[0.25, 0.5]);
    let turns = document.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.5, 0.5, 0.5, 0.5]);
    document.animation(&[(json!({"node": 1, "path": "rotation"}), times, turns, "LINEAR")]);
    document
}

/// A humanoid with expressions and eyes that look about.
fn vrm(is_new: bool) -> Document {
    let mut document = features();
    let (hips, head) = (json!({"node": 0}), json!({"node": 3}));
    let range = json!({"inputMaxValue": 90, "outputScale": 10});
    document.json["extensions"] = if is_new {
        json!({"VRMC_vrm": {"specVersion": "1.0", "humanoid": {"humanBones": {"hips": hips, "spine": {"node": 1}, "head": head}},
            "expressions": {"preset": {"happy": {"morphTargetBinds": [{"node": 2, "index": 0, "weight": 1}]}}, "custom": {"wink": {}}},
            "lookAt": {"type": "expression", "rangeMapHorizontalInner": range, "rangeMapVerticalDown": range}}})
    } else {
        json!({"VRM": {"specVersion": "0.0",
            "humanoid": {"humanBones": [{"bone": "hips", "node": 0}, {"bone": "spine", "node": 1}, {"bone": "head", "node": 3}]},
            "blendShapeMaster": {"blendShapeGroups": [{"name": "Joy", "presetName": "joy", "binds": [{"mesh": 0, "index": 0, "weight": 100}]}]},
            "firstPerson": {"lookAtTypeName": "BlendShape", "lookAtHorizontalOuter": {"xRange": 90, "yRange": 1}}}})
    };
    document.json["extensionsUsed"] = json!(["VRMC_vrm", "VRM", "KHR_mesh_quantization"]);
    document
}

/// An animation of a humanoid with an expression and a gaze.
pub(super) fn vrm_animation() -> Vec<u8> {
    let mut document = features();
    document.json["extensions"] = json!({"VRMC_vrm_animation": {"specVersion": "1.0",
        "humanoid": {"humanBones": {"hips": {"node": 0}, "spine": {"node": 1}, "head": {"node": 3}}},
        "expressions": {"preset": {"happy": {"node": 1}}, "custom": {"wink": {"node": 0}}}, "lookAt": {"node": 3}}});
    document.json["extensionsUsed"] = json!(["VRMC_vrm_animation"]);
    document.into_glb()
}
