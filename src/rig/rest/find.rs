//! Which of the poses that a file offers is its rest pose.

use crate::model::{Clip, LocalPose, Reporter, Scene};

use super::{
    super::{
        error::{SpecError, SpecErrorKind, SpecField},
        lookup::find_clip,
        recognition::Recognizer,
        spec::{ClipChoice, RestFrame, RestRule, RestSpec, RigSpec},
    },
    RestSource,
    bind::{BindPose, bind_pose},
    standing::{Stand, is_biped, is_moment, is_overridden, is_without_mesh, stand, standing_frame},
};

/// A rest pose, and how it was come by.
pub(in crate::rig) struct Rest {
    /// Local, of the rig's own skeleton.
    pub(in crate::rig) pose: LocalPose,
    pub(in crate::rig) source: RestSource,
    /// Why this one: a clause for people.
    pub(in crate::rig) reason: String,
    /// What to write into a spec to get the same again.
    pub(in crate::rig) spec: RestSpec,
    /// Whether a T pose is to be made of it.
    pub(in crate::rig) is_to_be_solved: bool,
}

/// The rest pose of a rig, by the order of [`RestRule::Auto`] where the spec does not say.
pub(in crate::rig) fn find_rest(
    name: &'static str,
    scene: &Scene,
    spec: &RigSpec,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Result<Rest, SpecError> {
    let found = match &spec.rest {
        RestSpec::Frame(frame) => clip_frame(name, scene, frame).map_err(SpecError::from_field)?,
        RestSpec::Rule(RestRule::Nodes) => {
            laid_out(scene, RestSource::Nodes, "the config asks for the node transforms")
        }
        RestSpec::Rule(RestRule::Bind) => match bind_pose(scene, recognizer, reporter, name) {
            BindPose::Other(pose) => {
                Found { pose, ..laid_out(scene, RestSource::Bind, "the config asks for the bind pose") }
            }
            _ => laid_out(scene, RestSource::Nodes, "the file has no bind pose of its own"),
        },
        RestSpec::Rule(rule @ (RestRule::Auto | RestRule::Solved)) => {
            let found = of_the_file(name, scene, recognizer, reporter);
            // Files that say their axes have a rest pose by design, unless they are a motion and nothing else, written from a file without
            // one; and who says the axes of one knows the rig.
            let may_have_none = || scene.axes.is_none() || is_motion_without_rest(scene, &found, recognizer);
            match rule {
                RestRule::Auto if spec.axes.is_none() && may_have_none() => in_a_step(
                    name,
                    scene,
                    instead_of_none(name, scene, found, recognizer, reporter),
                    recognizer,
                    reporter,
                ),
                RestRule::Auto => in_a_step(name, scene, found, recognizer, reporter),
                _ => found,
            }
        }
    };
    let Found { pose, source, reason, frame } = found;
    let solve = spec.rest == RestSpec::Rule(RestRule::Solved) || source == RestSource::Solved;
    Ok(Rest {
        pose,
        source: if solve { RestSource::Solved } else { source },
        reason: if spec.rest == RestSpec::Rule(RestRule::Solved) { "the config asks for it".into() } else { reason },
        spec: match frame {
            Some((clip, frame)) => RestSpec::Frame(RestFrame { clip: ClipChoice::Index(clip), frame }),
            None if solve => RestSpec::Rule(RestRule::Solved),
            None => spec.rest.clone(),
        },
        is_to_be_solved: solve,
    })
}

/// A pose of a file.
pub(super) struct Found {
    pub(super) pose: LocalPose,
    pub(super) source: RestSource,
    pub(super) reason: String,
    /// Clip and frame that were found, where nobody named them.
    pub(super) frame: Option<(usize, usize)>,
}

/// The node transforms of a file, called something.
pub(super) fn laid_out(scene: &Scene, source: RestSource, reason: impl Into<String>) -> Found {
    Found { pose: scene.skeleton.rest_pose(), source, reason: reason.into(), frame: None }
}

fn clip_frame(name: &str, holder: &Scene, frame: &RestFrame) -> Result<Found, SpecField> {
    let pose = pose_of_frame(name, holder, &frame.clip, frame.frame, &format!("/{name}/rest"))?;
    let reason = format!("the config names frame {} of a clip", frame.frame);
    Ok(Found { pose, source: RestSource::ClipFrame, reason, frame: None })
}

/// A frame of a clip that a spec names.
pub(super) fn pose_of_frame(
    name: &str,
    scene: &Scene,
    clip: &ClipChoice,
    frame: usize,
    pointer: &str,
) -> Result<LocalPose, SpecField> {
    let clip = &scene.clips[find_clip(scene, clip, name, &format!("{pointer}/clip"))?];
    if frame >= clip.frame_count() {
        let detail = format!("frame {frame} is past the clip's {} frames", clip.frame_count());
        return Err(SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/frame"), detail));
    }
    Ok(clip.local_pose(&scene.skeleton, frame))
}

/// The bind pose where it says something, else the node transforms.
fn of_the_file(name: &str, scene: &Scene, recognizer: Recognizer<'_>, reporter: &mut Reporter) -> Found {
    let pose = match bind_pose(scene, recognizer, reporter, name) {
        BindPose::Missing => {
            return laid_out(scene, RestSource::Nodes, "the file has no bind pose, only the transforms of its nodes");
        }
        BindPose::SameAsNodes => {
            return laid_out(scene, RestSource::Nodes, "the nodes are as they were when the skins were bound");
        }
        BindPose::OtherLengths => {
            return laid_out(scene, RestSource::Nodes, "the bind pose has bones of other lengths than the nodes");
        }
        BindPose::Other(pose) => pose,
    };
    let (bind, nodes) = (stand(scene, &pose, recognizer), stand(scene, &scene.skeleton.rest_pose(), recognizer));
    if bind <= nodes {
        let reason = "the skins were bound in it; the nodes hold another pose";
        return Found { pose, ..laid_out(scene, RestSource::Bind, reason) };
    }
    reporter.warn(
        "bind_pose_ignored",
        name,
        "the skins were bound in a pose that is no rest pose of a body; the node transforms are measured from instead",
        format!("set {name}.rest to \"bind\" if limbs come out bent"),
    );
    laid_out(scene, RestSource::Nodes, "the pose that the skins were bound in is no rest pose of a body")
}

/// Whether a file has no mesh, and its rest pose is no body, or not of the bones that its clip moves, while a frame of that is one: a capture
/// whose bones lie on one axis at zero, in a format that has a rest pose.
fn is_motion_without_rest(scene: &Scene, found: &Found, recognizer: Recognizer<'_>) -> bool {
    found.source == RestSource::Nodes
        && is_without_mesh(scene)
        && (is_overridden(scene) || stand(scene, &found.pose, recognizer) == Stand::No)
        && standing_frame(scene, Stand::No, recognizer).is_some()
}

/// What to measure from where a file's rest pose is no body that stands.
pub(super) fn instead_of_none(
    name: &str,
    scene: &Scene,
    found: Found,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Found {
    let is_of_other_bones = is_overridden(scene);
    let own = if is_of_other_bones { Stand::No } else { stand(scene, &found.pose, recognizer) };
    if own <= Stand::Named {
        return found;
    }
    let hint = format!("name a better pose in {name}.rest, or send a rest file; a T pose is best");
    // Any frame is of the right bones at least.
    let any = || scene.clips.iter().position(Clip::is_animated).filter(|_| is_of_other_bones).map(|clip| (clip, 0));
    if let Some((clip, frame)) = standing_frame(scene, own, recognizer).or_else(any) {
        let clip_name = scene.clips[clip].name().to_owned();
        reporter.warn(
            "rest_pose_from_clip",
            name,
            format!(
                "the rest pose of the file is no body that stands with its arms in a known pose, or not of the bones that its clip \
                 moves; frame {frame} of the clip '{clip_name}' is measured from instead"
            ),
            hint,
        );
        let pose = scene.clips[clip].local_pose(&scene.skeleton, frame);
        let reason = format!(
            "the file's own is no rest pose of the bones that its clip moves, and frame {frame} is the first that can be"
        );
        return Found { pose, source: RestSource::StandingFrame, reason, frame: Some((clip, frame)) };
    }
    if own != Stand::No || !is_biped(scene, &found.pose, recognizer) {
        return found;
    }
    reporter.warn(
        "rest_pose_solved",
        name,
        "neither the rest pose nor any frame of the file is a body that stands; a T pose was made of it by role",
        hint,
    );
    let reason = "neither the file's own pose nor any frame is a body that stands";
    Found { source: RestSource::Solved, reason: reason.into(), ..found }
}

/// Itself, and where it is a moment of a walk, called so: how its feet and hands lie then says nothing.
fn in_a_step(name: &str, scene: &Scene, found: Found, recognizer: Recognizer<'_>, reporter: &mut Reporter) -> Found {
    if found.source != RestSource::Nodes || !is_moment(scene, &found.pose, recognizer) {
        return found;
    }
    let clip = scene.clips.iter().position(Clip::is_animated);
    let of_clip =
        clip.map_or_else(String::new, |clip| format!("the first frame of the clip '{}', ", scene.clips[clip].name()));
    reporter.warn(
        "rest_pose_from_clip",
        name,
        format!("the rest pose of the file is {of_clip}in the middle of a step"),
        format!("name a better pose in {name}.rest, or send a rest file; a T pose is best"),
    );
    let reason = "the file has no bind pose, and its nodes stand in the middle of a step";
    let frame = clip.map(|clip| (clip, 0));
    Found { source: RestSource::StandingFrame, reason: reason.into(), frame, ..found }
}
