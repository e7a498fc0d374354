//! Which pose of a rest file is meant.

use crate::model::{Clip, LocalPose, Reporter, Scene};

use super::super::{
    super::{
        error::SpecError,
        recognition::Recognizer,
        spec::{ClipChoice, RestFrame, RestRule, RestSpec},
    },
    RestSource,
    bind::{BindPose, bind_pose},
    find::{Found, instead_of_none, laid_out, pose_of_frame},
    standing::{Stand, stand},
};

/// Rotations closer than this are the same pose.
const SAME_POSE_RADIANS: f64 = 0.02;

/// A pose of a rest file.
pub(super) struct Choice {
    pub(super) pose: LocalPose,
    pub(super) source: RestSource,
    /// A clause for people.
    pub(super) reason: String,
    /// What to write into a spec to get the same again.
    pub(super) spec: RestSpec,
    /// The pose in which its skins were bound, where that is another one and nobody said which is meant.
    pub(super) bind: Option<LocalPose>,
    /// What else could have been meant, and the way to say so.
    pub(super) doubt: Option<(String, String)>,
}

/// The pose that a spec names, else the one that the file stands in: its nodes, but where these are no body that stands and the
/// pose that the skins were bound in is one. Of a BVH that holds a single pose it is that pose.
pub(super) fn choose(
    side: &'static str,
    scene: &Scene,
    spec: &RestSpec,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Result<Choice, SpecError> {
    let of_found = |found: Found, spec: &RestSpec| Choice {
        pose: found.pose,
        source: found.source,
        reason: found.reason,
        spec: spec.clone(),
        bind: None,
        doubt: None,
    };
    Ok(match spec {
        RestSpec::Frame(RestFrame { clip, frame }) => {
            let pose = pose_of_frame(&format!("{side} rest"), scene, clip, *frame, &format!("/{side}/rest"))
                .map_err(SpecError::from_field)?;
            let reason = format!("the config names frame {frame} of a clip of the rest file");
            of_found(Found { pose, source: RestSource::ClipFrame, reason, frame: None }, spec)
        }
        RestSpec::Rule(RestRule::Nodes) => {
            of_found(laid_out(scene, RestSource::Upload, "the config asks for the nodes of the rest file"), spec)
        }
        RestSpec::Rule(RestRule::Bind) => match bind_pose(scene, recognizer, reporter, side) {
            BindPose::Other(pose) => {
                let reason = "the config asks for the pose in which the skins of the rest file were bound";
                of_found(Found { pose, ..laid_out(scene, RestSource::Upload, reason) }, spec)
            }
            _ => of_found(laid_out(scene, RestSource::Upload, "the rest file has no bind pose of its own"), spec),
        },
        RestSpec::Rule(RestRule::Auto | RestRule::Solved) => found_out(side, scene, spec, recognizer, reporter),
    })
}

fn found_out(
    side: &'static str,
    scene: &Scene,
    spec: &RestSpec,
    recognizer: Recognizer<'_>,
    reporter: &mut Reporter,
) -> Choice {
    let nodes = Choice {
        pose: scene.skeleton.rest_pose(),
        source: RestSource::Upload,
        reason: "a rest file was given, and counts as its nodes stand".to_owned(),
        spec: spec.clone(),
        bind: None,
        doubt: None,
    };
    if let Some((clip, frame)) = held_frame(scene) {
        let pose = scene.clips[clip].local_pose(&scene.skeleton, frame);
        if scene.axes.is_none() {
            return instead_of_zero_pose(scene, pose, nodes, side, recognizer);
        }
        let doubt = (
            format!(
                "the clip '{}' of the rest file holds another pose than its nodes; the nodes are taken",
                scene.clips[clip].name()
            ),
            format!("set {side}.rest to {{\"clip\": {clip}, \"frame\": 0}} if the clip is meant"),
        );
        return Choice { doubt: Some(doubt), ..nodes };
    }
    if scene.axes.is_none() {
        let zero = laid_out(scene, RestSource::Upload, nodes.reason.clone());
        let Found { pose, source, reason, frame } = instead_of_none(side, scene, zero, recognizer, reporter);
        let spec = frame
            .map_or(nodes.spec, |(clip, frame)| RestSpec::Frame(RestFrame { clip: ClipChoice::Index(clip), frame }));
        return Choice { pose, source, reason, spec, bind: None, doubt: None };
    }
    match bind_pose(scene, recognizer, &mut Reporter::new(), side) {
        BindPose::Other(bind) => nodes_or_bind(scene, nodes, bind, side, recognizer),
        _ => nodes,
    }
}

/// A BVH of a single pose was made to show that pose, whatever its joints are at zero.
fn instead_of_zero_pose(
    scene: &Scene,
    pose: LocalPose,
    nodes: Choice,
    side: &str,
    recognizer: Recognizer<'_>,
) -> Choice {
    let (frame, zero) = (stand(scene, &pose, recognizer), stand(scene, &nodes.pose, recognizer));
    if frame > zero {
        let doubt = (
            "the frame of the rest file is no body that stands in a known pose; the pose with all channels at zero is taken".to_owned(),
            format!("set {side}.rest to {{\"clip\": 0, \"frame\": 0}} if the frame is meant"),
        );
        return Choice { doubt: Some(doubt), ..nodes };
    }
    let doubt = (zero == Stand::LaidOut).then(|| {
        (
            "the rest file holds one frame, and another pose with all channels at zero; the frame is taken".to_owned(),
            format!("set {side}.rest to \"nodes\" if the pose with all channels at zero is meant"),
        )
    });
    Choice {
        pose,
        reason: "a rest file was given, and counts as the single pose that it holds".to_owned(),
        spec: RestSpec::Frame(RestFrame { clip: ClipChoice::Index(0), frame: 0 }),
        doubt,
        ..nodes
    }
}

fn nodes_or_bind(scene: &Scene, nodes: Choice, bind: LocalPose, side: &str, recognizer: Recognizer<'_>) -> Choice {
    let (bound, standing) = (stand(scene, &bind, recognizer), stand(scene, &nodes.pose, recognizer));
    if standing > Stand::Named && bound <= Stand::Named {
        let doubt = (
            "the nodes of the rest file are no body that stands in a known pose; the pose that its skins were bound in is \
             taken"
                .to_owned(),
            format!("set {side}.rest to \"nodes\" if the nodes are meant"),
        );
        let reason =
            "a rest file was given, and counts as its skins were bound, since its nodes are no body that stands";
        return Choice { pose: bind, reason: reason.to_owned(), doubt: Some(doubt), ..nodes };
    }
    let doubt = (bound < standing).then(|| {
        (
            "the skins of the rest file were bound in another pose than its nodes stand in; the nodes are taken"
                .to_owned(),
            format!("set {side}.rest to \"bind\" if the bind pose is meant, to \"nodes\" to be sure"),
        )
    });
    let reason = "a rest file was given, and counts as its nodes stand; its skins were bound in another pose";
    Choice { reason: reason.to_owned(), bind: Some(bind), doubt, ..nodes }
}

/// The first frame of the only clip, where that holds still in another pose than the nodes.
fn held_frame(scene: &Scene) -> Option<(usize, usize)> {
    let [clip] = scene.clips.as_slice() else { return None };
    if clip.frame_count() == 0 || is_moving(clip) {
        return None;
    }
    let held = clip.local_pose(&scene.skeleton, 0);
    let mut joints = scene.skeleton.joints().iter().zip(held.transforms());
    let differs = joints.any(|(joint, held)| joint.rest.rotation.angle_between(held.rotation) > SAME_POSE_RADIANS);
    differs.then_some((0, 0))
}

fn is_moving(clip: &Clip) -> bool {
    clip.frame_count() > 1 && clip.is_animated()
}
