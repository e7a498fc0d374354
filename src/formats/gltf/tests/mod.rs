//! Small documents built in code, read and written.

mod hostile;
mod read_animation;
mod read_document;
mod read_points;
mod write;

use base64::{Engine as _, engine::general_purpose::STANDARD};
use serde_json::{Value, json};

use crate::{
    formats::{self, Format, FormatError, Limits},
    model::{Control, Reporter, Scene, Warning},
};

/// A document under construction. Starts with nodes `hips`, `spine` (its child) and `spare`.
struct Builder {
    json: Value,
    binary: Vec<u8>,
}

impl Builder {
    fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"},
            "nodes": [{"name": "hips", "children": [1]}, {"name": "spine"}, {"name": "spare"}],
            "bufferViews": [],
            "accessors": [],
        });
        Self { json, binary: Vec::new() }
    }

    /// Adds a view of these bytes.
    fn view(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let view = json!({"buffer": 0, "byteOffset": self.binary.len(), "byteLength": bytes.len()});
        self.binary.extend(bytes);
        push(&mut self.json["bufferViews"], view)
    }

    /// Adds an accessor over a view.
    fn accessor(&mut self, view: usize, component: u64, count: usize, shape: &str) -> usize {
        let accessor = json!({"bufferView": view, "componentType": component, "count": count, "type": shape});
        push(&mut self.json["accessors"], accessor)
    }

    /// Adds an accessor of floats.
    fn floats(&mut self, floats: &[f32], shape: &str) -> usize {
        let width = match shape {
            "SCALAR" => 1,
            "VEC3" => 3,
            "VEC4" => 4,
            _ => 16,
        };
        let view = self.view(bytemuck::cast_slice(floats));
        let index = self.accessor(view, 5126, floats.len() / width, shape);
        if shape == "SCALAR" {
            self.json["accessors"][index]["min"] = json!([floats[0]]);
            self.json["accessors"][index]["max"] = json!([floats[floats.len() - 1]]);
        }
        index
    }

    /// Adds an animation with one channel.
    fn animation(&mut self, node: usize, path: &str, sampler: Value) -> &mut Self {
        if self.json.get("animations").is_none() {
            self.json["animations"] = json!([]);
        }
        let channels = json!([{"sampler": 0, "target": {"node": node, "path": path}}]);
        push(&mut self.json["animations"], json!({"channels": channels, "samplers": [sampler]}));
        self
    }

    fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.clone();
        if !self.binary.is_empty() && json.get("buffers").is_none() {
            let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&self.binary));
            json["buffers"] = json!([{"byteLength": self.binary.len(), "uri": uri}]);
        }
        json.to_string().into_bytes()
    }

    fn read(&self) -> Result<(Scene, Vec<Warning>), FormatError> {
        read_bytes(&self.bytes())
    }
}

fn push(array: &mut Value, value: Value) -> usize {
    let array = array.as_array_mut().expect("the builder makes arrays");
    array.push(value);
    array.len() - 1
}

fn read_bytes(bytes: &[u8]) -> Result<(Scene, Vec<Warning>), FormatError> {
    let mut reporter = Reporter::new();
    let scene = formats::read(bytes, Format::Gltf, &Limits::default(), &Control::new(), &mut reporter)?;
    Ok((scene, reporter.into_warnings()))
}

fn codes(warnings: &[Warning]) -> Vec<&'static str> {
    warnings.iter().map(|warning| warning.code).collect()
}
