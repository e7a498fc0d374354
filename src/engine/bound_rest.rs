//! The rest pose of a skeleton that is written without its mesh.
//!
//! A character is often saved in the middle of a clip: its nodes crouch, and only the skins say how it was bound. A file that has the nodes and
//! not the skins would rest crouching.

use crate::{
    formats::{self, WriteOptions},
    model::{Clip, ClipError, Joint, JointTracks, Scene, Skeleton, Track, Transform},
    rig::{RestSource, Rig},
};

/// The scene and the clip with the bind pose at rest, where that is what the rig was measured from and the file will hold nothing that says
/// so. Nothing else moves: what a clip left at rest is held where it was.
pub(super) fn bound_at_rest(
    target: &Rig<'_>,
    clip: &Clip,
    options: &WriteOptions,
) -> Result<Option<(Scene, Clip)>, ClipError> {
    let scene = target.scene;
    let is_bound = target.rest_source == RestSource::Bind && scene.stretched.is_none();
    if !is_bound || formats::says_bind_pose(scene, options) {
        return Ok(None);
    }
    let skeleton = &scene.skeleton;
    let joints = skeleton.joints().iter().zip(target.rest_local.transforms());
    let joints = joints.map(|(joint, bound)| Joint { rest: *bound, ..joint.clone() }).collect();
    let Ok(bound) = Skeleton::new(joints) else { return Ok(None) };
    let held = |clip: &Clip| clip.clone().with_joints(held_tracks(clip, skeleton, &bound));
    let clips = scene.clips.iter().map(held).collect::<Result<Vec<Clip>, ClipError>>()?;
    let clip = held(clip)?;
    Ok(Some((Scene { skeleton: bound, clips, ..scene.clone() }, clip)))
}

/// Tracks that hold what was at rest, where the joint rests elsewhere now.
fn held_tracks(clip: &Clip, before: &Skeleton, now: &Skeleton) -> Vec<JointTracks> {
    let rests = before.joints().iter().zip(now.joints()).map(|(before, now)| (before.rest, now.rest));
    let held = |(tracks, (before, now)): (&JointTracks, (Transform, Transform))| JointTracks {
        translation: hold(&tracks.translation, before.translation.as_vec3(), before.translation != now.translation),
        rotation: hold(&tracks.rotation, before.rotation.as_quat(), before.rotation != now.rotation),
        scale: hold(&tracks.scale, before.scale.as_vec3(), before.scale != now.scale),
    };
    clip.joints().iter().zip(rests).map(held).collect()
}

fn hold<T: Copy>(track: &Track<T>, before: T, is_elsewhere: bool) -> Track<T> {
    match track {
        Track::Rest if is_elsewhere => Track::Constant(before),
        track => track.clone(),
    }
}
