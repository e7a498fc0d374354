//! The pose in which the skins were bound.

use glam::DQuat;

use super::{super::recognition::Recognizer, standing::lean_of};
use crate::model::{LocalPose, ModelPose, Reporter, Scene, Transform};

/// How far a bone of the bind pose may be from the node pose's length, as a share of it, before the bind pose counts as being
/// about another skeleton.
const BONE_LENGTH_TOLERANCE: f64 = 0.05;
/// Rotations closer than this are the same pose.
const SAME_POSE_RADIANS: f64 = 0.02;
/// The whole body is turned to how the bind matrices have it where it then leans less by more than this: 5°. Trunks that are bent
/// lean by a little in any pose.
const LEANS_LESS_RADIANS: f64 = 0.087;

/// What the bind matrices of a file say.
#[derive(Clone, Debug)]
pub(in crate::rig) enum BindPose {
    /// Nothing: there are none, or none between two joints.
    Missing,
    /// The same as the node transforms.
    SameAsNodes,
    /// Something about a skeleton of other bone lengths.
    OtherLengths,
    /// Another pose than the node transforms.
    Other(LocalPose),
}

/// The local pose in which the skins were bound, where the file says so believably.
///
/// Inverse bind matrices are relative to a space that files are free to choose (the mesh's, the armature's), so only what
/// lies between joints is taken from them: a joint whose parent is bound too gets its bind rotation relative to that parent;
/// all others keep their node transform. The topmost bound joint, mostly the pelvis, carries the whole body with it: where the nodes
/// have it leaning and the bind matrices do not, its rotation is theirs. Scales stay the nodes', and so do translations, because bone lengths are the
/// skeleton's; but for joints that lie elsewhere below their parents when bound, as feet do that hang from the root.
///
/// Nothing is said of bind matrices of other bone lengths than the skeleton's.
pub(in crate::rig) fn bind_pose(
    scene: &Scene,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
    place: &str,
) -> BindPose {
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
    if bones == 0 {
        return BindPose::Missing;
    }
    if differing == 0 {
        return BindPose::SameAsNodes;
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
        return BindPose::OtherLengths;
    }
    BindPose::Other(set_upright(scene, pose, &nodes_model, recognizer))
}

/// The pose with the topmost bound joint as the bind matrices have it, where the body leans otherwise.
///
/// Files are free to choose the space of those matrices; it is that of the model or that of a node above the joint
/// (an armature).
fn set_upright(scene: &Scene, pose: LocalPose, nodes: &ModelPose, recognizer: Recognizer<'_>) -> LocalPose {
    let Some(((joint, bind), up)) = topmost_bound(scene).zip(scene.axes.map(|axes| axes.up().direction())) else {
        return pose;
    };
    let lean = |pose: &LocalPose| lean_of(scene, pose, up, recognizer);
    let Some(own) = lean(&pose) else { return pose };
    if own <= LEANS_LESS_RADIANS {
        return pose;
    }
    let model_from_parent =
        scene.skeleton.parent(joint).map_or(DQuat::IDENTITY, |parent| nodes.transforms()[parent].rotation);
    let ancestors = std::iter::successors(scene.skeleton.parent(joint), |ancestor| scene.skeleton.parent(*ancestor));
    let spaces = ancestors.map(|ancestor| nodes.transforms()[ancestor].rotation);
    let turned = std::iter::once(DQuat::IDENTITY).chain(spaces).filter_map(|model_from_bind| {
        let mut turned = pose.clone();
        let rotation = model_from_parent.conjugate() * model_from_bind * bind.rotation;
        turned.transforms_mut()[joint].rotation = rotation.normalize();
        Some((lean(&turned)?, turned))
    });
    // The first of equal ones: most files mean the model's space.
    let Some((least, upright)) = turned.min_by(|(first, _), (second, _)| first.total_cmp(second)) else { return pose };
    if least + LEANS_LESS_RADIANS < own { upright } else { pose }
}

/// The bound joint above all other bound ones, where it is one.
fn topmost_bound(scene: &Scene) -> Option<(usize, Transform)> {
    let is_topmost = |joint: usize| {
        let parent = scene.skeleton.parent(joint);
        parent.and_then(|parent| bound_ancestor(scene, parent)).is_none()
    };
    let bound = scene.bind_pose.iter().enumerate().filter_map(|(joint, bind)| Some((joint, (*bind)?)));
    let mut topmost = bound.filter(|(joint, _)| is_topmost(*joint));
    let first = topmost.next()?;
    topmost.next().is_none().then_some(first)
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
