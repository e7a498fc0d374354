//! A new document with the skeleton, and meshes where there are some, for targets that did not come from glTF.

use std::collections::BTreeMap;

use glam::{DQuat, DVec3};
use serde_json::{Map, Value};

use super::{
    Output, animation, meshes,
    schema::{Asset, Buffer, DocumentScene, List, Node},
    skins,
    streams::decoded_buffer,
    to_value,
};
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
    json.insert("asset".into(), to_value(&Asset { version: "2.0", generator })?);
    let mut output = Output::new(json, compression);
    if target.skeleton.is_empty() {
        animation::append(&mut output, target, clip, |index, _| index, &[], control, reporter)?;
        return Ok(output);
    }
    let joints = target.skeleton.joints();
    let roots: Vec<usize> = (0..joints.len()).filter(|joint| joints[*joint].parent.is_none()).collect();
    output.json.insert("scene".into(), 0.into());
    output.json.insert("scenes".into(), to_value(&[DocumentScene { nodes: &roots }])?);
    for (joint, children) in joints.iter().zip(target.skeleton.children()) {
        output.push(List::Nodes, &node(joint, &children))?;
    }
    let mut morph_nodes = Vec::new();
    match content {
        Content::Nodes => {}
        Content::Skins => {
            skins::add(&mut output, target, &[], reporter)?;
        }
        Content::Meshes(meshes) => {
            let skins = skins::add(&mut output, target, &meshes.meshes, reporter)?;
            if skins.need_common_root {
                add_common_root(&mut output, &roots)?;
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
    let mut buffers = vec![Buffer { byte_length: output.binary.length(), extensions: BTreeMap::new() }];
    buffers.extend((output.decoded_length > 0).then(|| decoded_buffer(output.decoded_length)));
    output.json.insert("buffers".into(), to_value(&buffers)?);
    Ok(output)
}

/// A unit quaternion whose components are at most 1, which rounding may have made a little larger.
pub(super) fn rotation(rotation: DQuat) -> [f64; 4] {
    rotation.to_array().map(|component| component.clamp(-1.0, 1.0))
}

pub(super) fn node<'a>(joint: &'a Joint, children: &'a [usize]) -> Node<'a> {
    let rest = &joint.rest;
    Node {
        name: &joint.name,
        translation: (rest.translation != DVec3::ZERO).then(|| rest.translation.to_array()),
        rotation: (rest.rotation != DQuat::IDENTITY).then(|| rotation(rest.rotation)),
        scale: (rest.scale != DVec3::ONE).then(|| rest.scale.to_array()),
        children,
        mesh: None,
        skin: None,
    }
}

/// One node above all others, behind them in the list: joints of one skin must have one.
fn add_common_root(output: &mut Output<'_>, roots: &[usize]) -> Result<(), FormatError> {
    let root = output.push(List::Nodes, &Node { name: "scene", children: roots, ..Node::default() })?;
    output.json.insert("scenes".into(), to_value(&[DocumentScene { nodes: &[root] }])?);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_is_within_the_range_of_the_format() {
        let above = DQuat::from_xyzw(0.0, 0.5, 0.0, 1.0 + f64::EPSILON);
        assert_eq!(rotation(above), [0.0, 0.5, 0.0, 1.0], "rounded up, and taken back");
    }
}
