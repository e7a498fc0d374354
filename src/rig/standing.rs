//! Which pose to measure from where the rest pose of a file is none: motion capture that keeps all bones on one axis at zero.

use crate::model::{Clip, LocalPose, Reporter, Scene};

use super::{
    recognition::{Hints, recognise},
    spec::{ClipChoice, RestFrame, RestSpec, RigSpec},
};

/// The same wishes, with the first frame of the first clip as the rest pose where the file's own rest pose is no body that
/// stands and that frame is one. Only for files that do not say their axes (BVH), as all others have a rest pose by design, and not
/// where the spec says them: who knows a rig that well knows its rest pose.
#[must_use]
pub fn with_standing_rest(side: &'static str, scene: &Scene, spec: &RigSpec, reporter: &mut Reporter) -> RigSpec {
    let is_open = scene.axes.is_none() && spec.rest == RestSpec::default() && spec.axes.is_none();
    let stands = |pose: &LocalPose| {
        let model = pose.to_model(&scene.skeleton);
        recognise(&scene.skeleton, &model, &Hints::of(scene)).body.is_some()
    };
    let clip = scene.clips.iter().position(Clip::is_animated);
    let Some(clip) = clip.filter(|_| is_open && !stands(&scene.skeleton.rest_pose())) else { return spec.clone() };
    if !stands(&scene.clips[clip].local_pose(&scene.skeleton, 0)) {
        return spec.clone();
    }
    reporter.warn(
        "rest_pose_from_clip",
        side,
        "the rest pose of the file is no body that stands; the first frame of its first clip is measured from instead",
        format!("name a better pose in {side}.rest, or send a rest file; a T pose is best"),
    );
    RigSpec { rest: RestSpec::Frame(RestFrame { clip: ClipChoice::Index(clip), frame: 0 }), ..spec.clone() }
}
