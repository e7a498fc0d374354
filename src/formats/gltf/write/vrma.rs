//! A VRM animation: a humanoid's nodes without any mesh, one animation, and which node is which bone, expression or gaze.
//!
//! Weights of expressions are translations along X of nodes that stand for them. (VRMC_vrm_animation 1.0.)

use glam::Vec3;
use serde_json::{Map, Value, json};

use super::skeleton::{self, Content};
use crate::{
    formats::{FormatError, WriteOptions},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Transform, VRM_EXPRESSIONS},
};

const EXTENSION: &str = "VRMC_vrm_animation";
/// Encodes the clip of a humanoid whose rest pose is a T pose; the joints that its file declares as bones are its bones.
pub(super) fn write(
    target: &Scene,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    if target.declared_convention != Some("vrma") || target.stretched.is_some() {
        return Err(FormatError::unsupported(
            "write",
            "",
            "a VRM animation is written of what a humanoid does, and this is none, or only a pose",
            "retarget or edit a clip of a body whose joints are recognized, or ask for .glb",
        ));
    }
    let malformed = |error: &dyn std::fmt::Display| FormatError::malformed("write", "", error.to_string());
    let mut joints: Vec<Joint> = target.skeleton.joints().to_vec();
    let mut tracks: Vec<JointTracks> = clip.joints().to_vec();
    let mut expressions = [("preset", Map::new()), ("custom", Map::new())];
    for track in clip.morphs() {
        let Some(morph) = target.morphs.get(track.morph) else { continue };
        let kind = usize::from(!VRM_EXPRESSIONS.contains(&morph.name.as_str()));
        expressions[kind].1.insert(morph.name.clone(), json!({"node": joints.len()}));
        let node = joints.len();
        joints.push(Joint { name: morph.name.clone(), parent: None, rest: Transform::IDENTITY, is_joint: false, node });
        let translation = track.weights.map(|weight| Vec3::X * weight.clamp(0.0, 1.0));
        tracks.push(JointTracks { translation, ..JointTracks::default() });
    }
    let skeleton = Skeleton::new(joints).map_err(|error| malformed(&error))?;
    let scene = Scene { skeleton, ..Scene::default() };
    let clip =
        Clip::new(clip.name().to_owned(), clip.times_seconds().to_vec(), tracks).map_err(|error| malformed(&error))?;

    let mut output =
        skeleton::build(&scene, (&clip, std::iter::empty()), Content::Nodes, options.compression, control, reporter)?;
    output.json.insert("extensionsUsed".into(), json!([EXTENSION]));
    output.json.insert("extensions".into(), json!({EXTENSION: extension(target, expressions)}));
    super::finish(output, options, control, reporter)
}

fn extension(target: &Scene, expressions: [(&str, Map<String, Value>); 2]) -> Value {
    let bones: Map<String, Value> =
        target.declared_roles.iter().map(|(role, joint)| (role.clone(), json!({"node": joint}))).collect();
    let mut extension = Map::new();
    extension.insert("specVersion".into(), "1.0".into());
    extension.insert("humanoid".into(), json!({"humanBones": bones}));
    let expressions: Map<String, Value> = expressions
        .into_iter()
        .filter(|(_, members)| !members.is_empty())
        .map(|(kind, members)| (kind.to_owned(), Value::Object(members)))
        .collect();
    if !expressions.is_empty() {
        extension.insert("expressions".into(), Value::Object(expressions));
    }
    if let Some(node) = target.gaze_joint {
        extension.insert("lookAt".into(), json!({"node": node, "offsetFromHeadBone": [0.0, 0.0, 0.0]}));
    }
    Value::Object(extension)
}
