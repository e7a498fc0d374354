//! Morph targets of meshes, and the expressions of VRM 0.x, VRM 1.0 and VRM animations.
//!
//! What is wrong with meshes alone is no error, so whatever is not as it should be is left out.

use serde_json::Value;

use super::{look_at, nodes::Graph};
use crate::{
    formats::{Budget, FormatError},
    model::{LookAt, Morph, MorphPlace},
};

/// Names of VRM 0.x presets that VRM 1.0 calls otherwise.
const VRM0_PRESETS: [(&str, &str); 14] = [
    ("a", "aa"),
    ("i", "ih"),
    ("u", "ou"),
    ("e", "ee"),
    ("o", "oh"),
    ("blink_l", "blinkLeft"),
    ("blink_r", "blinkRight"),
    ("joy", "happy"),
    ("sorrow", "sad"),
    ("fun", "relaxed"),
    ("lookup", "lookUp"),
    ("lookdown", "lookDown"),
    ("lookleft", "lookLeft"),
    ("lookright", "lookRight"),
];

/// What the file can do with faces.
#[derive(Debug, Default)]
pub(super) struct Morphs {
    pub(super) all: Vec<Morph>,
    /// First morph and their number, per joint whose node has a mesh with morph targets.
    pub(super) of_joint: std::collections::BTreeMap<usize, (usize, usize)>,
    /// Expressions of a VRM animation: the joint whose translation along X is the weight, and the morph.
    pub(super) of_translation: Vec<(usize, usize)>,
    /// What shapes that look aside mean.
    pub(super) look_at: Option<LookAt>,
    /// The joint that a VRM animation turns to where its figure looks.
    pub(super) gaze_joint: Option<usize>,
}

/// Reads them from the document.
pub(super) fn read(document: &Value, graph: &Graph, budget: &mut Budget<'_>) -> Result<Morphs, FormatError> {
    let mut morphs = Morphs::default();
    let nodes = document["nodes"].as_array().map_or(&[][..], Vec::as_slice);
    for (node, value) in nodes.iter().enumerate() {
        let Some(mesh) = value["mesh"].as_u64().and_then(|mesh| document["meshes"].get(mesh as usize)) else {
            continue;
        };
        let count = mesh["primitives"][0]["targets"].as_array().map_or(0, Vec::len);
        if count == 0 || node >= graph.joint_of_node.len() {
            continue;
        }
        budget.take_array(count as u64, size_of::<Morph>() as u64, "meshes")?;
        let names = [&mesh["extras"]["targetNames"], &mesh["primitives"][0]["extras"]["targetNames"]];
        let names = names.into_iter().find(|names| names.is_array()).unwrap_or(&Value::Null);
        let rests = if value["weights"].is_array() { &value["weights"] } else { &mesh["weights"] };
        morphs.of_joint.insert(graph.joint_of_node[node], (morphs.all.len(), count));
        morphs.all.extend((0..count).map(|index| Morph {
            name: names[index].as_str().map_or_else(|| format!("target_{index}"), str::to_owned),
            rest: rests[index].as_f64().and_then(single).unwrap_or(0.0),
            place: MorphPlace::Mesh { node, index, count },
        }));
    }
    let extensions = &document["extensions"];
    morphs.look_at = look_at::read(extensions);
    let gaze_node = extensions["VRMC_vrm_animation"]["lookAt"]["node"].as_u64();
    morphs.gaze_joint = gaze_node.and_then(|node| graph.joint_of_node.get(node as usize).copied());
    morphs.read_vrm1(&extensions["VRMC_vrm"]["expressions"], graph);
    morphs.read_vrm0(&extensions["VRM"]["blendShapeMaster"]["blendShapeGroups"], nodes, graph);
    morphs.read_animation(&extensions["VRMC_vrm_animation"]["expressions"], graph);
    Ok(morphs)
}

impl Morphs {
    fn read_vrm1(&mut self, expressions: &Value, graph: &Graph) {
        for (name, expression) in named(expressions) {
            let binds = expression["morphTargetBinds"].as_array().map_or(&[][..], Vec::as_slice);
            let binds = binds.iter().filter_map(|bind| {
                let joint = graph.joint_of_node.get(bind["node"].as_u64()? as usize)?;
                self.bind(*joint, &bind["index"], bind["weight"].as_f64().unwrap_or(1.0))
            });
            let place = MorphPlace::Expression(binds.collect());
            self.all.push(Morph { name: name.clone(), rest: 0.0, place });
        }
    }

    fn read_vrm0(&mut self, groups: &Value, nodes: &[Value], graph: &Graph) {
        for group in groups.as_array().map_or(&[][..], Vec::as_slice) {
            let mut place = Vec::new();
            for bind in group["binds"].as_array().map_or(&[][..], Vec::as_slice) {
                let users = nodes.iter().enumerate().filter(|(_, node)| {
                    let mesh = node["mesh"].as_u64();
                    mesh.is_some() && mesh == bind["mesh"].as_u64()
                });
                let weight = bind["weight"].as_f64().unwrap_or(100.0) / 100.0;
                let joints = users.filter_map(|(node, _)| graph.joint_of_node.get(node));
                place.extend(joints.filter_map(|joint| self.bind(*joint, &bind["index"], weight)));
            }
            let preset = group["presetName"].as_str().unwrap_or_default().to_lowercase();
            let known = VRM0_PRESETS.iter().find(|(old, _)| *old == preset).map(|(_, new)| *new);
            let name = match known {
                Some(name) => name,
                None if matches!(preset.as_str(), "" | "unknown") => group["name"].as_str().unwrap_or_default(),
                None => &preset,
            };
            self.all.push(Morph { name: name.to_owned(), rest: 0.0, place: MorphPlace::Expression(place) });
        }
    }

    fn read_animation(&mut self, expressions: &Value, graph: &Graph) {
        for (name, expression) in named(expressions) {
            let node = expression["node"].as_u64().and_then(|node| graph.joint_of_node.get(node as usize));
            let Some(joint) = node else { continue };
            self.of_translation.push((*joint, self.all.len()));
            self.all.push(Morph { name: name.clone(), rest: 0.0, place: MorphPlace::Expression(Vec::new()) });
        }
    }

    fn bind(&self, joint: usize, index: &Value, weight: f64) -> Option<(usize, f32)> {
        let (first, count) = self.of_joint.get(&joint)?;
        let index = index.as_u64().map(|index| index as usize).filter(|index| index < count)?;
        Some((first + index, single(weight)?))
    }
}

/// A weight in single precision; `None` for what is too large for it.
fn single(weight: f64) -> Option<f32> {
    let weight = weight as f32;
    weight.is_finite().then_some(weight)
}

/// Expressions by name, presets before custom ones.
fn named(expressions: &Value) -> impl Iterator<Item = (&String, &Value)> {
    ["preset", "custom"].into_iter().filter_map(|kind| expressions[kind].as_object()).flatten()
}
