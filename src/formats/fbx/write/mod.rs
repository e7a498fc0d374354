//! A clip into binary FBX: the skeleton, its rest pose, one take, and the meshes of a target that was FBX itself, with their
//! materials, images and shapes.
//!
//! Joints are limb nodes with their rest rotation as pre-rotation, so that zero angles are the rest pose and the angles of a clip
//! stay small; curves have one linear key per frame, as Euler angles X, Y, Z that go on where the frame before was (see
//! [`crate::formats::euler`]). Lengths are centimeters, which every reader takes for granted. Without
//! meshes, only joints and what is above them are written.

mod animation;
mod binary;
mod curves;
mod figure;
mod materials;
mod mesh;
mod records;
mod scene;

use crate::{
    formats::{FormatError, Include, WriteOptions, euler::report_orders, fbx::FbxDocument, written},
    model::{Clip, Control, Reporter, Scene, Track},
};

use mesh::Meshes;

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
    let everything = options.include == Include::Everything;
    let document = target.payload.get::<FbxDocument>().filter(|_| everything);
    let joints = match document {
        Some(_) => (0..skeleton.len()).collect(),
        None => written::joints_to_write(skeleton),
    };
    written::warn_of_lost_motion(target, clip, &joints, "our FBX does", reporter);
    if everything && document.is_none() && !target.skins.is_empty() {
        reporter.warn(
            "fbx_mesh_left_out",
            "",
            "the file holds the skeleton and its animation; only meshes of an FBX are written as FBX",
            "send the target as FBX, load the file onto the character in the program that has it, or ask for glb",
        );
    }
    let centimeters = target.unit_meters.unwrap_or(1.0) * 100.0;
    let meshes = match document {
        Some(document) => Meshes::new(document, skeleton, centimeters, figure::node_id, control)?,
        None => Meshes::default(),
    };
    meshes.materials.report(reporter);
    let mut figure = figure::Figure::new(skeleton, &joints, centimeters);
    if let Some(order) = options.rotation_order {
        figure.nodes.iter_mut().for_each(|node| node.order = order);
    }
    let curves = curves::of_nodes(&figure, clip, options.rotation_order.is_none(), control)?;
    for (node, curves) in figure.nodes.iter_mut().zip(&curves) {
        node.order = curves.order;
    }
    if options.rotation_order.is_none() {
        let by_name = figure.nodes.iter().map(|node| (figure.name(node), node.order));
        report_orders(figure::USUAL_ORDER, "Objects", by_name, reporter);
    }
    let mut animation = animation::Animation::new(clip);
    let shapes = |clip| document.map_or_else(Vec::new, |document| shapes(document, clip, &meshes));
    animation.add_stack(&figure, clip, curves, &shapes(clip), control)?;
    for clip in written::kept_clips(target, options) {
        let curves = curves::of_nodes(&figure, clip, false, control)?;
        animation.add_stack(&figure, clip, curves, &shapes(clip), control)?;
    }
    let records = scene::records(&figure, animation, meshes, target.axes.unwrap_or_default());
    binary::file(records).ok_or_else(|| {
        FormatError::unsupported(
            "write",
            "Objects",
            "the clip is larger than an FBX of 32-bit offsets can be",
            "write a part of it, or another format",
        )
    })
}

/// The blend shapes that a clip moves: their weights, and the ids of what they are, one for each mesh that they are on.
fn shapes<'c>(document: &FbxDocument, clip: &'c Clip, meshes: &Meshes) -> Vec<(&'c Track<f32>, i64)> {
    let moved = clip.morphs().iter().filter_map(|track| Some((track, document.properties.shape(track.morph)?)));
    let ids = |shape| meshes.shapes.get(&shape).into_iter().flatten();
    moved.flat_map(|(track, shape)| ids(shape).map(move |id| (&track.weights, *id))).collect()
}
