//! A new document with the skeleton and nothing else, for targets that did not come from glTF.

use std::borrow::Cow;

use glam::{DMat4, DQuat, DVec3};
use serde_json::{Map, Value, json};

use super::{Output, animation, streams::decoded_buffer};
use crate::{
    formats::{Compression, FormatError},
    model::{Clip, Control, Joint, Reporter, Scene},
};

const FLOAT: u64 = 5126;

/// Which skins a new document has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Skins {
    /// None.
    None,
    /// One for each tree of joints.
    OfTrees,
}

/// All joints as nodes in the order of the skeleton, one scene, the skins, the animation.
pub(super) fn build<'a>(
    target: &Scene,
    clip: &'a Clip,
    skins: Skins,
    compression: Compression,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Output<'a>, FormatError> {
    let mut json = Map::new();
    let generator = concat!("retargetd ", env!("CARGO_PKG_VERSION"));
    json.insert("asset".into(), json!({"version": "2.0", "generator": generator}));
    let mut output = Output::new(json, compression);
    if target.skeleton.is_empty() {
        animation::append(&mut output, target, clip, |index, _| index, false, control, reporter)?;
        return Ok(output);
    }
    let joints = target.skeleton.joints();
    let roots: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].parent.is_none()).collect();
    let nodes = joints.iter().zip(target.skeleton.children()).map(|(joint, children)| node(joint, &children));
    output.json.insert("scene".into(), json!(0));
    output.json.insert("scenes".into(), json!([{"nodes": roots}]));
    output.json.insert("nodes".into(), Value::Array(nodes.collect()));
    if skins == Skins::OfTrees {
        add_skins(&mut output, target, reporter);
    }
    control.check()?;

    // Nodes are numbered as the joints are here, not as they were in the file that they came from.
    let animation = animation::append(&mut output, target, clip, |index, _| index, false, control, reporter)?;
    if let Some(animation) = animation {
        output.json.insert("animations".into(), Value::Array(vec![animation]));
    }
    let mut buffers = vec![json!({"byteLength": output.binary.length()})];
    buffers.extend((output.decoded_length > 0).then(|| decoded_buffer(output.decoded_length)));
    output.json.insert("buffers".into(), Value::Array(buffers));
    Ok(output)
}

/// A unit quaternion whose components are at most 1, which rounding may have made a little larger.
pub(super) fn rotation(rotation: DQuat) -> Value {
    json!(rotation.to_array().map(|component| component.clamp(-1.0, 1.0)))
}

fn node(joint: &Joint, children: &[usize]) -> Value {
    let mut node = Map::new();
    if !joint.name.is_empty() {
        node.insert("name".into(), joint.name.as_str().into());
    }
    if joint.rest.translation != DVec3::ZERO {
        node.insert("translation".into(), json!(joint.rest.translation.to_array()));
    }
    if joint.rest.rotation != DQuat::IDENTITY {
        node.insert("rotation".into(), rotation(joint.rest.rotation));
    }
    if joint.rest.scale != DVec3::ONE {
        node.insert("scale".into(), json!(joint.rest.scale.to_array()));
    }
    if !children.is_empty() {
        node.insert("children".into(), json!(children));
    }
    Value::Object(node)
}

/// The joints of a skin must be in one tree, so there is one skin for each tree that has joints.
fn add_skins(output: &mut Output<'_>, target: &Scene, reporter: &mut Reporter) {
    let joints = target.skeleton.joints();
    let any_marked = joints.iter().any(|joint| joint.is_joint);
    let mut tree_of: Vec<usize> = Vec::with_capacity(joints.len());
    let mut model_from_joint: Vec<DMat4> = Vec::with_capacity(joints.len());
    let mut trees: Vec<Vec<usize>> = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        let local = joint.rest.to_matrix();
        let (tree, matrix) = match joint.parent {
            Some(parent) => (tree_of[parent], model_from_joint[parent] * local),
            None => {
                trees.push(Vec::new());
                (trees.len() - 1, local)
            }
        };
        tree_of.push(tree);
        model_from_joint.push(matrix);
        if joint.is_joint || !any_marked {
            trees[tree].push(index);
        }
    }
    let name = target.skins.first().map_or("", |skin| skin.name.as_str());
    let (mut skins, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    for members in trees.iter().filter(|members| !members.is_empty()) {
        let mut columns: Vec<f32> = Vec::with_capacity(members.len() * 16);
        for joint in members {
            columns.extend(inverse_bind(&model_from_joint[*joint]).unwrap_or_else(|| {
                let detail =
                    "the rest pose flattens this joint, so it has no inverse bind matrix; the identity was written";
                reporter.warn("bind_matrix_singular", target.skeleton.label(*joint), detail, "");
                glam::Mat4::IDENTITY.to_cols_array()
            }));
        }
        let length = columns.len() * size_of::<f32>();
        let offset = output.binary.push(Cow::Owned(bytemuck::cast_slice(&columns).to_vec()));
        let index = views.len();
        views.push(json!({"buffer": 0, "byteOffset": offset, "byteLength": length}));
        accessors.push(json!({"bufferView": index, "componentType": FLOAT, "count": members.len(), "type": "MAT4"}));
        let mut skin = Map::new();
        if !name.is_empty() {
            skin.insert("name".into(), name.into());
        }
        skin.insert("inverseBindMatrices".into(), json!(index));
        skin.insert("joints".into(), json!(members));
        skins.push(Value::Object(skin));
    }
    output.json.insert("skins".into(), Value::Array(skins));
    output.json.insert("accessors".into(), Value::Array(accessors));
    output.json.insert("bufferViews".into(), Value::Array(views));
}

fn inverse_bind(model_from_joint: &DMat4) -> Option<[f32; 16]> {
    let inverse = model_from_joint.inverse();
    let mut columns = inverse.is_finite().then(|| inverse.as_mat4())?.to_cols_array();
    // The last row of an affine matrix, without rounding: validators compare it bit for bit.
    (columns[3], columns[7], columns[11], columns[15]) = (0.0, 0.0, 0.0, 1.0);
    columns.iter().all(|number| number.is_finite()).then_some(columns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_is_within_the_range_of_the_format() {
        let above = DQuat::from_xyzw(0.0, 0.5, 0.0, 1.0 + f64::EPSILON);
        assert_eq!(rotation(above), json!([0.0, 0.5, 0.0, 1.0]), "rounded up, and taken back");
    }
}
