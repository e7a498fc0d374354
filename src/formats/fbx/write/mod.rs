//! A clip into binary FBX: the skeleton, its rest pose, and one take.
//!
//! Joints are limb nodes with their rest rotation as pre-rotation, so that zero angles are the rest pose and the angles of a clip
//! stay small; curves have one linear key per frame, as Euler angles X, Y, Z that go on where the frame before was (see
//! [`crate::formats::euler`]). Lengths are centimetres, which every reader takes for granted. Written are the joints and what is
//! above them, not meshes.

mod animation;
mod binary;
mod scene;

use crate::{
    formats::{FormatError, WriteOptions, euler::report_orders, written},
    model::{Clip, Control, Reporter, Scene},
};

/// Encodes `clip`.
///
/// # Errors
/// When the target has no node, the clip needs more than the four gigabytes that the container can address, or the work is
/// canceled.
pub(in crate::formats) fn write(
    target: &Scene,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let skeleton = &target.skeleton;
    if skeleton.is_empty() {
        return Err(FormatError::unsupported(
            "write",
            "Objects",
            "the target has no node that could be written",
            "choose a target with a skeleton",
        ));
    }
    let joints = written::joints_to_write(skeleton);
    written::warn_of_lost_motion(target, clip, &joints, "our FBX does", reporter);
    if !target.skins.is_empty() {
        reporter.warn(
            "fbx_mesh_left_out",
            "",
            "the file holds the skeleton and its animation; meshes, skins and materials are not written as FBX",
            "load it onto the character in the program that has it, or ask for glb",
        );
    }
    let centimetres = target.unit_metres.unwrap_or(1.0) * 100.0;
    let mut figure = scene::Figure::new(skeleton, &joints, centimetres);
    for node in &mut figure.nodes {
        control.check()?;
        node.order = options.rotation_order.unwrap_or_else(|| node.steadiest_order(clip));
    }
    if options.rotation_order.is_none() {
        let by_name = figure.nodes.iter().map(|node| (figure.name(node), node.order));
        report_orders(animation::USUAL_ORDER, "Objects", by_name, reporter);
    }
    let animation = animation::Animation::new(&figure, clip, control)?;
    let records = scene::records(&figure, animation, target.axes.unwrap_or_default());
    binary::file(&records).ok_or_else(|| {
        FormatError::unsupported(
            "write",
            "Objects",
            "the clip is larger than an FBX of 32-bit offsets can be",
            "write a part of it, or another format",
        )
    })
}
