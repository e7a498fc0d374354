//! What of a target goes into a file of another format: which nodes, where there is room for a skeleton and nothing else, and its
//! meshes.

use crate::model::{Canceled, Clip, Control, Reporter, Scene, Skeleton};

use super::{TargetClips, WriteOptions, fbx, meshes::Meshes};

/// The joints and everything above them; all nodes where the file calls none a joint.
pub(super) fn joints_to_write(skeleton: &Skeleton) -> Vec<usize> {
    let joints = skeleton.joints();
    if !joints.iter().any(|joint| joint.is_joint) {
        return (0..joints.len()).collect();
    }
    let mut wanted: Vec<bool> = joints.iter().map(|joint| joint.is_joint).collect();
    // Parents come before children, so one pass from the end reaches every ancestor.
    for index in (0..joints.len()).rev() {
        if let Some(parent) = joints[index].parent
            && wanted[index]
        {
            wanted[parent] = true;
        }
    }
    wanted.iter().enumerate().filter(|(_, wanted)| **wanted).map(|(index, _)| index).collect()
}

/// The clips that a target has already and that move something, where they are to follow the new one: all but the one that it replaces.
pub(super) fn kept_clips<'a>(target: &'a Scene, options: &WriteOptions) -> impl Iterator<Item = &'a Clip> {
    let fits = |clip: &&Clip| clip.is_animated() && clip.joints().len() == target.skeleton.len();
    let others = target.clips.iter().enumerate().filter(|(index, _)| options.replaced_clip != Some(*index));
    let count = if options.target_clips == TargetClips::Keep { usize::MAX } else { 0 };
    others.map(|(_, clip)| clip).filter(fits).take(count)
}

/// Reports nodes that move and are not written; `format` is who leaves them out, such as "FBX does".
pub(super) fn warn_of_lost_motion(
    target: &Scene,
    clip: &Clip,
    joints: &[usize],
    format: &str,
    reporter: &mut Reporter,
) {
    for (index, tracks) in clip.joints().iter().enumerate() {
        let is_animated =
            tracks.translation.is_animated() || tracks.rotation.is_animated() || tracks.scale.is_animated();
        if is_animated && joints.binary_search(&index).is_err() {
            reporter.warn(
                "node_left_out",
                target.skeleton.label(index),
                format!("the node is animated but is not a joint, so {format} not hold it"),
                "write glTF when nodes outside the skeleton matter",
            );
        }
    }
}

/// The meshes of a target that came from a format which hands them on; nothing where it has none. Meshes that are there and cannot be
/// handed on are reported.
///
/// # Errors
/// When the work is canceled.
pub(super) fn meshes<'a>(
    target: &'a Scene,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Option<Meshes<'a>>, Canceled> {
    fbx::meshes(target, control, reporter)
}
