//! The pose that a file means as its rest pose, where nobody says otherwise.

use crate::model::{ModelPose, Scene, Transform};

/// Where a rest pose comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestSource {
    /// The pose in which the skins were bound.
    BindPose,
    /// The transforms of the nodes.
    NodeTransforms,
}

/// A bind pose counts when this share of its bones is as long as in the node transforms.
const CONSISTENT_SHARE: f64 = 0.9;
/// Lengths that differ by more than this share are different.
const LENGTH_SHARE: f64 = 0.02;

/// The bind pose where the file has one that fits the skeleton, else the node transforms.
///
/// Joints that no skin binds keep their node transform relative to their parent. A bind pose of other bone lengths (another
/// scale, or matrices that an exporter left at identity) is no pose of this skeleton, and is passed over.
#[must_use]
pub fn scene_rest(scene: &Scene) -> (ModelPose, RestSource) {
    let local = scene.skeleton.rest_pose();
    let nodes = local.to_model(&scene.skeleton);
    let bound = |joint: usize| scene.bind_pose.get(joint).copied().flatten();
    let mut bind: Vec<Transform> = Vec::with_capacity(scene.skeleton.len());
    let (mut bones, mut alike) = (0_usize, 0_usize);
    let longest = |transforms: &[Transform]| {
        transforms.iter().map(|transform| transform.translation.abs().max_element()).fold(0.0, f64::max)
    };
    let negligible = longest(nodes.transforms()) * 1e-4;
    for (joint, local) in local.transforms().iter().enumerate() {
        let parent = scene.skeleton.parent(joint);
        let transform =
            bound(joint).unwrap_or_else(|| parent.map_or(*local, |parent| bind[parent].then_child(local)));
        bind.push(transform);
        if let Some(parent) = parent.filter(|parent| bound(joint).is_some() && bound(*parent).is_some()) {
            let in_bind = transform.translation.distance(bind[parent].translation);
            let in_nodes =
                nodes.transforms()[joint].translation.distance(nodes.transforms()[parent].translation);
            bones += 1;
            alike += usize::from((in_bind - in_nodes).abs() <= (in_nodes * LENGTH_SHARE).max(negligible));
        }
    }
    let fits = bones > 0 && alike as f64 >= CONSISTENT_SHARE * bones as f64;
    if fits && bind.iter().all(Transform::is_finite) {
        (ModelPose::new(bind), RestSource::BindPose)
    } else {
        (nodes, RestSource::NodeTransforms)
    }
}
