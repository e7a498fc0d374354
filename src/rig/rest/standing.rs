//! Which frame of a clip can stand in for a rest pose that is none: motion capture that keeps all bones on one axis at zero, or
//! overrides its offsets in every frame.

use glam::DVec3;

use crate::model::{Clip, LocalPose, ModelPose, Scene};

use super::super::recognition::{
    Hints, Part, Recognition, Recognizer, RestPoseKind, RigKind, Role, Side, lean, recognize,
};

/// Frames that are tried, evenly spread over a clip. A capture that holds no body in any of them holds none.
const FRAMES_TRIED: usize = 12;

/// A bone whose clip has it elsewhere than the rest pose by more than this share of its length is another bone.
const OTHER_BONE: f64 = 0.3;
/// With more than one in so many of those, the clip moves another skeleton than the rest pose shows.
const ONE_IN_OTHER: usize = 5;

/// Legs of which a bone of the one and the mirrored one of the other are by more than this apart are in the middle of a step.
const STEP_DEGREES: f64 = 15.0;
/// A joint is where a frame of a clip has it to this share of the length of its bone, and turned as there to as many radians.
const SAME: f64 = 1e-3;

/// How far a pose is a body, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Stand {
    /// It stands in a T pose or an A pose: somebody laid it out.
    LaidOut,
    /// It stands with its arms down.
    Named,
    /// It stands.
    Stands,
    /// It does not.
    No,
}

/// How far a pose of a scene's skeleton is a body.
pub(super) fn stand(scene: &Scene, pose: &LocalPose, recognizer: Recognizer<'_>) -> Stand {
    let recognition = recognized(scene, pose, recognizer);
    match (&recognition.body, recognition.rest_pose) {
        (None, _) => Stand::No,
        (Some(_), RestPoseKind::Other) => Stand::Stands,
        (Some(_), RestPoseKind::T | RestPoseKind::A) => Stand::LaidOut,
        (Some(_), RestPoseKind::ArmsDown) => Stand::Named,
    }
}

/// Whether the joints are those of a body with limbs, in whatever pose.
pub(super) fn is_biped(scene: &Scene, pose: &LocalPose, recognizer: Recognizer<'_>) -> bool {
    recognized(scene, pose, recognizer).kind == RigKind::Biped
}

/// How far the body of a pose leans against an axis that is up, in radians; nothing where it is no body.
pub(super) fn lean_of(scene: &Scene, pose: &LocalPose, vertical: DVec3, recognizer: Recognizer<'_>) -> Option<f64> {
    let model = pose.to_model(&scene.skeleton);
    let recognition = recognize(&scene.skeleton, &model, &Hints { recognizer, ..Hints::of(scene) });
    lean(&recognition.roles, &model, vertical)
}

fn recognized(scene: &Scene, pose: &LocalPose, recognizer: Recognizer<'_>) -> Recognition {
    let model = pose.to_model(&scene.skeleton);
    recognize(&scene.skeleton, &model, &Hints { recognizer, ..Hints::of(scene) })
}

/// The first frame of the first clip in which a body stands: clip, and frame. Instead of a pose that stands, only a first frame that
/// was laid out will do: in the middle of a dance, arms are in an A pose by chance.
pub(super) fn standing_frame(scene: &Scene, instead_of: Stand, recognizer: Recognizer<'_>) -> Option<(usize, usize)> {
    let index = scene.clips.iter().position(Clip::is_animated)?;
    let clip = &scene.clips[index];
    let stands = |frame: &usize| stand(scene, &clip.local_pose(&scene.skeleton, *frame), recognizer);
    if instead_of != Stand::No {
        return (stands(&0) == Stand::LaidOut).then_some((index, 0));
    }
    let step = clip.frame_count().div_ceil(FRAMES_TRIED).max(1);
    let frame = (0..clip.frame_count()).step_by(step).find(|frame| stands(frame) != Stand::No)?;
    Some((index, frame))
}

/// Whether a pose that nobody bound a mesh in is in the middle of a step, and the first frame of the clip that moves, where one does:
/// nobody laid that out.
pub(super) fn is_moment(scene: &Scene, pose: &LocalPose, recognizer: Recognizer<'_>) -> bool {
    is_without_mesh(scene)
        && scene.clips.iter().find(|clip| clip.is_animated()).is_none_or(|clip| is_first_frame(scene, pose, clip))
        && is_step(&recognized(scene, pose, recognizer), &pose.to_model(&scene.skeleton))
}

/// Whether a file has no mesh that was bound to its joints. A skin that no mesh has was bound by nobody: writers make one, or a bind pose, so
/// that viewers show a skeleton.
pub(super) fn is_without_mesh(scene: &Scene) -> bool {
    scene.skin_points.is_empty() && scene.skins.iter().all(|skin| skin.most_influences == 0)
}

fn is_first_frame(scene: &Scene, pose: &LocalPose, clip: &Clip) -> bool {
    let first = clip.local_pose(&scene.skeleton, 0);
    let joints = scene.skeleton.joints().iter().zip(pose.transforms().iter().zip(first.transforms()));
    joints.filter(|(joint, _)| joint.is_joint).all(|(_, (own, first))| {
        let length = own.translation.length().max(first.translation.length());
        own.translation.distance(first.translation) <= SAME * length
            && own.rotation.angle_between(first.rotation) <= SAME
    })
}

/// Whether a bone of one leg points elsewhere than that of the other one does.
fn is_step(body: &Recognition, pose: &ModelPose) -> bool {
    let place = |side, part| {
        let joint = *body.roles.get(&Role::new(side, part))?.joints.first()?;
        Some(pose.transforms()[joint].translation)
    };
    let hips = place(Side::Left, Part::Thigh).zip(place(Side::Right, Part::Thigh));
    let Some(across) = hips.and_then(|(left, right)| (left - right).try_normalize()) else { return false };
    let bones = [(Part::Thigh, Part::Shin), (Part::Shin, Part::Foot), (Part::Foot, Part::Toe)];
    bones.into_iter().any(|(from, to)| {
        let bone = |side| Some(place(side, to)? - place(side, from)?);
        let both = bone(Side::Left).zip(bone(Side::Right));
        both.is_some_and(|(left, right)| left.angle_between(right.reflect(across)) > STEP_DEGREES.to_radians())
    })
}

/// Whether the first clip has the bones elsewhere than the rest pose: its position channels override the offsets, which then are
/// of no pose that the clip is about.
pub(super) fn is_overridden(scene: &Scene) -> bool {
    let Some(clip) = scene.clips.iter().find(|clip| clip.is_animated()) else { return false };
    let first = clip.local_pose(&scene.skeleton, 0);
    let bones = scene.skeleton.joints().iter().zip(first.transforms());
    let (mut count, mut others) = (0, 0);
    for (joint, posed) in bones.filter(|(joint, _)| joint.is_joint && joint.parent.is_some()) {
        let length = joint.rest.translation.length().max(posed.translation.length());
        count += 1;
        others += usize::from(joint.rest.translation.distance(posed.translation) > OTHER_BONE * length);
    }
    others * ONE_IN_OTHER > count
}
