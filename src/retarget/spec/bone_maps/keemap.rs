//! KeeMap's mapping: JSON with a list of bones.

use serde_json::Value;

use super::pairs::{Pair, spec};
use crate::rig::error::{SpecError, SpecErrorKind, SpecField};

/// Whether a document is such a map.
pub(in crate::retarget) fn is_map(document: &Value) -> bool {
    let bones = document["bones"].as_array();
    bones.and_then(|bones| bones.first()).is_some_and(|bone| bone.get("DestinationBoneName").is_some())
}

/// The spec that a map stands for. Bones that are not keyed, or whose rotation and position are both off, are left out; the first bone
/// that takes a position over carries the body.
pub(in crate::retarget) fn convert(document: &Value) -> Result<Value, SpecError> {
    let (mut pairs, mut fields): (Vec<Pair>, Vec<SpecField>) = (Vec::new(), Vec::new());
    let mut has_root = false;
    for (index, bone) in document["bones"].as_array().into_iter().flatten().enumerate() {
        let pointer = format!("/bones/{index}");
        let mut name = |field: &str| {
            let text = bone[field].as_str();
            if text.is_none() {
                let detail = format!("bone {index} has no '{field}'");
                fields.push(SpecField::new(SpecErrorKind::InvalidValue, format!("{pointer}/{field}"), detail));
            }
            text.unwrap_or_default().to_owned()
        };
        let (source, target) = (name("SourceBoneName"), name("DestinationBoneName"));
        let is_on = |field: &str, usual: bool| bone[field].as_bool().unwrap_or(usual);
        let has_position = is_on("set_bone_position", false);
        let is_used = is_on("keyframe_this_bone", true) && (has_position || is_on("set_bone_rotation", true));
        if source.is_empty() || target.is_empty() || !is_used {
            continue;
        }
        let is_root = has_position && !has_root;
        has_root |= is_root;
        pairs.push(Pair { pointer, source, target, is_root, has_position });
    }
    match SpecError::from_fields(fields) {
        Some(error) => Err(error),
        None => spec(&pairs),
    }
}
