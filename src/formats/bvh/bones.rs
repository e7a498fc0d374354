//! Which nodes of a skeleton a BVH holds, in which order, and where.

use glam::DVec3;

use crate::model::{Clip, LocalPose, ModelPose, Reporter, Skeleton, Track};

/// A translation that stays this close to the offset, as a part of the skeleton's size, needs no channels: it is the same
/// number after rounding to f32.
const STILL: f64 = 2e-8;

/// A joint of the file.
#[derive(Debug)]
pub(super) struct Bone {
    /// Joint of the skeleton.
    pub(super) joint: usize,
    /// The joint above it in the file; nothing for a ROOT, which carries everything above it.
    pub(super) parent_joint: Option<usize>,
    /// Levels below the ROOT.
    pub(super) depth: usize,
    /// A name that a BVH can hold.
    pub(super) name: String,
    /// Where it is at rest, seen from its parent, in the axes of the world.
    pub(super) offset: DVec3,
    /// Whether it has position channels.
    pub(super) has_position: bool,
    /// Offsets of its End Sites.
    pub(super) ends: Vec<DVec3>,
}

/// The bones in the order of the file: depth first, so that every block is closed before the next begins.
pub(super) fn bones(skeleton: &Skeleton, clip: &Clip, rest: &ModelPose, reporter: &mut Reporter) -> Vec<Bone> {
    let children = skeleton.children();
    let is_kept = kept(skeleton, clip, &children);
    let is_top = |joint: usize| is_kept[joint] && skeleton.parent(joint).is_none_or(|parent| !is_kept[parent]);
    let local = skeleton.rest_pose();
    let extent = extent(rest);
    let scale_moves = scale_moves(skeleton, clip);
    let mut open: Vec<(usize, usize)> =
        (0..skeleton.len()).rev().filter(|joint| is_top(*joint)).map(|top| (top, 0)).collect();
    if open.len() > 1 {
        reporter.warn(
            "several_roots",
            "HIERARCHY",
            format!(
                "the skeleton has {} top joints, so the file has as many ROOTs, which some programs do not read",
                open.len()
            ),
            "join the top joints below one root",
        );
    }
    let mut bones = Vec::new();
    while let Some((joint, depth)) = open.pop() {
        let below = children[joint].iter().rev().copied().filter(|child| is_kept[*child]);
        open.extend(below.map(|child| (child, depth + 1)));
        let parent_joint = if depth == 0 { None } else { skeleton.parent(joint) };
        let offset = match parent_joint {
            Some(_) => unrotated(skeleton, joint, rest, &local, rest),
            None => rest.transforms()[joint].translation,
        };
        let has_position = parent_joint.is_none_or(|parent| {
            scale_moves[parent] || translation_moves(skeleton, clip, joint, rest.transforms()[parent].scale, extent)
        });
        let mut ends: Vec<DVec3> = children[joint]
            .iter()
            .filter(|child| is_end(skeleton, **child, joint, &children))
            .map(|child| unrotated(skeleton, *child, rest, &local, rest))
            .collect();
        if ends.is_empty() && !children[joint].iter().any(|child| is_kept[*child]) {
            // Most readers insist on an end; where it lies, the skeleton does not say.
            ends.push(DVec3::ZERO);
        }
        let name = name(skeleton, joint, reporter);
        bones.push(Bone { joint, parent_joint, depth, name, offset, has_position, ends });
    }
    bones
}

/// A joint's translation in a pose, seen from its parent, in the axes that the parent has in a BVH.
pub(super) fn unrotated(
    skeleton: &Skeleton,
    joint: usize,
    rest: &ModelPose,
    local: &LocalPose,
    model: &ModelPose,
) -> DVec3 {
    let translation = local.transforms()[joint].translation;
    let Some(parent) = skeleton.parent(joint) else { return translation };
    rest.transforms()[parent].rotation * (model.transforms()[parent].scale * translation)
}

/// Joints, and the nodes between and above them, but not a still node on top that only carries one thing.
fn kept(skeleton: &Skeleton, clip: &Clip, children: &[Vec<usize>]) -> Vec<bool> {
    let joints = skeleton.joints();
    let has_joints = joints.iter().any(|joint| joint.is_joint);
    let mut is_kept: Vec<bool> = joints.iter().map(|joint| joint.is_joint || !has_joints).collect();
    for joint in (0..joints.len()).rev() {
        if is_kept[joint]
            && let Some(parent) = joints[joint].parent
        {
            is_kept[parent] = true;
        }
    }
    for joint in 0..joints.len() {
        let tracks = &clip.joints()[joint];
        let is_still =
            !tracks.translation.is_animated() && !tracks.rotation.is_animated() && !tracks.scale.is_animated();
        let is_on_top = joints[joint].parent.is_none_or(|parent| !is_kept[parent]);
        let carried = children[joint].iter().filter(|child| is_kept[**child]).count();
        if is_kept[joint] && !joints[joint].is_joint && is_still && is_on_top && carried == 1 {
            is_kept[joint] = false;
        }
    }
    is_kept
}

/// Whether a node is what the reader makes of an End Site.
fn is_end(skeleton: &Skeleton, node: usize, parent: usize, children: &[Vec<usize>]) -> bool {
    let [node_name, parent_name] = [node, parent].map(|joint| skeleton.joints()[joint].name.as_str());
    !skeleton.joints()[node].is_joint
        && children[node].is_empty()
        && node_name.strip_suffix("_end") == Some(parent_name)
}

/// Per joint, whether its accumulated scale changes over the clip.
fn scale_moves(skeleton: &Skeleton, clip: &Clip) -> Vec<bool> {
    let mut moves: Vec<bool> = Vec::with_capacity(skeleton.len());
    for (joint, tracks) in skeleton.joints().iter().zip(clip.joints()) {
        let own = match &tracks.scale {
            Track::Rest => false,
            Track::Constant(value) => *value != joint.rest.scale.as_vec3(),
            Track::Sampled(_) => true,
        };
        moves.push(own || joint.parent.is_some_and(|parent| moves[parent]));
    }
    moves
}

fn translation_moves(skeleton: &Skeleton, clip: &Clip, joint: usize, parent_scale: DVec3, extent: f64) -> bool {
    let rest = skeleton.joints()[joint].rest.translation;
    let moved = |value: &glam::Vec3| (parent_scale * (value.as_dvec3() - rest)).length() > extent * STILL;
    match &clip.joints()[joint].translation {
        Track::Rest => false,
        Track::Constant(value) => moved(value),
        Track::Sampled(values) => values.iter().any(moved),
    }
}

fn extent(rest: &ModelPose) -> f64 {
    rest.transforms().iter().map(|transform| transform.translation.length()).fold(0.0, f64::max)
}

/// A name without what ends a name in a BVH.
fn name(skeleton: &Skeleton, joint: usize, reporter: &mut Reporter) -> String {
    let original = &skeleton.joints()[joint].name;
    let ends_name = |character: char| character.is_control() || matches!(character, '{' | '}');
    let clean = original.replace(ends_name, "_");
    let clean = clean.trim();
    let written = if clean.is_empty() { format!("joint_{joint}") } else { clean.to_owned() };
    if written != *original {
        reporter.warn(
            "joint_renamed",
            skeleton.label(joint),
            format!("the name cannot stand in a BVH; it was written as '{written}'"),
            "",
        );
    }
    written
}
