//! The pose that retargeting measures from.

use glam::DVec3;

use crate::model::{LocalPose, ModelPose, Reporter, Scene, Skeleton, Transform};

/// How far a bone of the bind pose may be from the node pose's length, as a share of it, before the bind pose counts as being
/// about another skeleton.
const BONE_LENGTH_TOLERANCE: f64 = 0.05;
/// Rotations closer than this are the same pose.
const SAME_POSE_RADIANS: f64 = 0.02;

/// Where a rest pose came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RestSource {
    /// A file that was uploaded for it.
    Upload,
    /// A frame of a clip that the spec names.
    ClipFrame,
    /// The pose in which the skins were bound.
    Bind,
    /// The node transforms.
    Nodes,
}

impl RestSource {
    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Upload => "upload",
            Self::ClipFrame => "clip_frame",
            Self::Bind => "bind",
            Self::Nodes => "nodes",
        }
    }
}

/// The rest pose of a file where nobody says otherwise: the bind pose where skins give one, else the node transforms.
#[must_use]
pub fn scene_rest(scene: &Scene, reporter: &mut Reporter, place: &str) -> (LocalPose, RestSource) {
    match bind_pose(scene, reporter, place) {
        Some(pose) => (pose, RestSource::Bind),
        None => (scene.skeleton.rest_pose(), RestSource::Nodes),
    }
}

/// The local pose in which the skins were bound, where the file says so believably.
///
/// Inverse bind matrices are relative to a space that files are free to choose (the mesh's, the armature's), so only what
/// lies between joints is taken from them: a joint whose parent is bound too gets its bind rotation relative to that parent;
/// all others keep their node transform. Scales stay the nodes', and so do translations, because bone lengths are the
/// skeleton's; but for joints that lie elsewhere below their parents when bound, as feet do that hang from the root.
///
/// Returns nothing where no joint differs from its node, or the bind matrices are about other bone lengths.
pub(super) fn bind_pose(scene: &Scene, reporter: &mut Reporter, place: &str) -> Option<LocalPose> {
    let skeleton = &scene.skeleton;
    let nodes = skeleton.rest_pose();
    let nodes_model = nodes.to_model(skeleton);
    let mut pose = nodes.clone();
    let (mut differing, mut bones, mut misfits) = (0, 0, 0);
    for (joint, bind) in scene.bind_pose.iter().enumerate() {
        let (Some(bind), Some(parent)) = (bind, skeleton.parent(joint)) else { continue };
        // A joint between two bound ones may be missing from the skin; the nearest bound ancestor is as good when the nodes
        // between keep their rest.
        let Some((ancestor, ancestor_bind)) = bound_ancestor(scene, parent) else { continue };
        let relative = ancestor_bind.relative(bind);
        let between = relative_rest(&nodes_model, ancestor, parent);
        let local = between.relative(&relative);
        let node = nodes.transforms()[joint];
        bones += 1;
        if !same_length(&nodes_model, joint, ancestor, ancestor_bind, bind) {
            misfits += 1;
        }
        if local.rotation.angle_between(node.rotation) > SAME_POSE_RADIANS {
            differing += 1;
            pose.transforms_mut()[joint].rotation = local.rotation.normalize();
        }
        if moves_against(&local, &node) {
            pose.transforms_mut()[joint].translation = local.translation;
        }
    }
    if differing == 0 {
        return None;
    }
    if misfits * 4 > bones {
        reporter.warn(
            "bind_pose_ignored",
            place,
            format!(
                "{misfits} of {bones} bones of the bind pose have other lengths than the nodes; the node pose is taken"
            ),
            "re-bind the skin to the skeleton as it is, or name the rest pose in the config",
        );
        return None;
    }
    Some(pose)
}

/// Whether a joint lies elsewhere as seen from its parent, which a rotation of the parent does not explain.
fn moves_against(bind: &Transform, node: &Transform) -> bool {
    let longer = bind.translation.length().max(node.translation.length());
    bind.translation.distance(node.translation) > BONE_LENGTH_TOLERANCE * longer + 1e-9
}

fn bound_ancestor(scene: &Scene, from: usize) -> Option<(usize, Transform)> {
    let mut current = Some(from);
    while let Some(joint) = current {
        if let Some(Some(bind)) = scene.bind_pose.get(joint) {
            return Some((joint, *bind));
        }
        current = scene.skeleton.parent(joint);
    }
    None
}

fn relative_rest(nodes: &ModelPose, ancestor: usize, joint: usize) -> Transform {
    nodes.transforms()[ancestor].relative(&nodes.transforms()[joint])
}

/// Compares a bone's share of its ancestor's scale, so that a bind space in other units does not matter.
fn same_length(nodes: &ModelPose, joint: usize, ancestor: usize, ancestor_bind: Transform, bind: &Transform) -> bool {
    let in_nodes = relative_rest(nodes, ancestor, joint).translation.length();
    let in_bind = ancestor_bind.relative(bind).translation.length();
    (in_nodes - in_bind).abs() <= BONE_LENGTH_TOLERANCE * in_nodes.max(in_bind) + 1e-9
}

/// Transfers the rest pose of an uploaded file onto a skeleton: joints of equal name take its local rotations, and its local
/// translations where the bone is of the same direction and length up to one factor.
///
/// Returns how many joints were found.
pub(super) fn take_over(skeleton: &Skeleton, pose: &mut LocalPose, other: &Skeleton, other_pose: &LocalPose) -> usize {
    let scale = size_ratio(skeleton, other);
    let mut found = 0;
    for (index, joint) in skeleton.joints().iter().enumerate() {
        let Some(twin) = other.find(&joint.name).filter(|_| !joint.name.is_empty()) else { continue };
        found += 1;
        let theirs = other_pose.transforms()[twin];
        let ours = &mut pose.transforms_mut()[index];
        ours.rotation = theirs.rotation;
        ours.translation = theirs.translation * scale;
        ours.scale = theirs.scale;
    }
    found
}

/// Length of our bones over theirs, over the joints that both have; 1 where there is nothing to compare or they agree to a
/// thousandth.
fn size_ratio(skeleton: &Skeleton, other: &Skeleton) -> f64 {
    let (mut ours, mut theirs) = (0.0, 0.0);
    for joint in skeleton.joints().iter().filter(|joint| joint.parent.is_some() && !joint.name.is_empty()) {
        if let Some(twin) = other.find(&joint.name).filter(|twin| other.parent(*twin).is_some()) {
            ours += length(joint.rest.translation);
            theirs += length(other.joints()[twin].rest.translation);
        }
    }
    let ratio = if theirs > 0.0 && ours > 0.0 { ours / theirs } else { 1.0 };
    if (ratio - 1.0).abs() < 1e-3 { 1.0 } else { ratio }
}

fn length(vector: DVec3) -> f64 {
    vector.length()
}
