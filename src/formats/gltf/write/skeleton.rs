//! A new document with the skeleton, and meshes where there are some, for targets that did not come from glTF.

use glam::{DQuat, DVec3};
use serde_json::{Map, Value, json};

use super::{Output, animation, meshes, skins, streams::decoded_buffer};
use crate::{
    formats::{Compression, FormatError, meshes::Meshes},
    model::{Clip, Control, Joint, Reporter, Scene},
};

/// What a new document has beside nodes.
#[derive(Debug)]
pub(super) enum Content<'a> {
    /// Nothing.
    Nodes,
    /// A skin for each tree of joints.
    Skins,
    /// Meshes, with the skins that they need.
    Meshes(Meshes<'a>),
}

/// All joints as nodes in the order of the skeleton, one scene, the skins and meshes, the animation and then those that are kept.
pub(super) fn build<'a>(
    target: &Scene,
    (clip, kept): (&'a Clip, impl Iterator<Item = &'a Clip>),
    content: Content<'a>,
    compression: Compression,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Output<'a>, FormatError> {
    let mut json = Map::new();
    let generator = concat!("retargetd ", env!("CARGO_PKG_VERSION"));
    json.insert("asset".into(), json!({"version": "2.0", "generator": generator}));
    let mut output = Output::new(json, compression);
    if target.skeleton.is_empty() {
        animation::append(&mut output, target, clip, |index, _| index, &[], control, reporter)?;
        return Ok(output);
    }
    let joints = target.skeleton.joints();
    let roots: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].parent.is_none()).collect();
    let nodes = joints.iter().zip(target.skeleton.children()).map(|(joint, children)| node(joint, &children));
    output.json.insert("scene".into(), json!(0));
    output.json.insert("scenes".into(), json!([{"nodes": roots}]));
    output.json.insert("nodes".into(), Value::Array(nodes.collect()));
    let mut morph_nodes = Vec::new();
    match content {
        Content::Nodes => {}
        Content::Skins => {
            skins::add(&mut output, target, &[], reporter)?;
        }
        Content::Meshes(meshes) => {
            let skins = skins::add(&mut output, target, &meshes.meshes, reporter)?;
            if skins.need_common_root {
                add_common_root(&mut output.json, &roots);
            }
            morph_nodes = meshes::add(&mut output, target, meshes, &skins, control)?;
        }
    }
    control.check()?;

    // Nodes are numbered as the joints are here, not as they were in the file that they came from.
    let animation = animation::append(&mut output, target, clip, |index, _| index, &morph_nodes, control, reporter)?;
    let mut animations: Vec<Value> = animation.into_iter().collect();
    for clip in kept {
        let kept = animation::append(&mut output, target, clip, |index, _| index, &morph_nodes, control, reporter)?;
        animations.extend(kept);
    }
    if !animations.is_empty() {
        output.json.insert("animations".into(), Value::Array(animations));
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

pub(super) fn node(joint: &Joint, children: &[usize]) -> Value {
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

/// One node above all others, behind them in the list: joints of one skin must have one.
fn add_common_root(json: &mut Map<String, Value>, roots: &[usize]) {
    let Some(nodes) = json.get_mut("nodes").and_then(Value::as_array_mut) else { return };
    nodes.push(json!({"name": "scene", "children": roots}));
    let root = nodes.len() - 1;
    json.insert("scenes".into(), json!([{"nodes": [root]}]));
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
