//! What a spec names, found: a joint of a skeleton, a clip of a file.

use crate::model::{Scene, Skeleton};

use super::{
    error::{SpecErrorKind, SpecField},
    spec::ClipChoice,
};

/// A joint by its name, by `#<node index>`, or by its name without a namespace.
///
/// # Errors
/// When there is none; the error has the nearest names.
pub(super) fn find_joint(skeleton: &Skeleton, side: &str, name: &str, pointer: &str) -> Result<usize, SpecField> {
    if let Some(joint) = skeleton.find(name) {
        return Ok(joint);
    }
    let by_node = name.strip_prefix('#').and_then(|digits| digits.parse::<usize>().ok());
    if let Some(joint) = by_node.and_then(|node| skeleton.joints().iter().position(|joint| joint.node == node)) {
        return Ok(joint);
    }
    let bare = |joint: &crate::model::Joint| joint.name.rsplit([':', '|']).next() == Some(name);
    let mut without_namespace = (0..skeleton.len()).filter(|index| bare(&skeleton.joints()[*index]));
    if let (Some(joint), None) = (without_namespace.next(), without_namespace.next()) {
        return Ok(joint);
    }
    let detail = format!("the {side} skeleton has no joint '{name}'");
    let names = skeleton.joints().iter().map(|joint| joint.name.as_str());
    Err(SpecField::new(SpecErrorKind::UnknownJoint, pointer, detail).with_nearest(name, names))
}

/// The clip that a spec names, on one side.
///
/// # Errors
/// When the file has no such clip; the error lists those that it has, and the nearest names.
pub fn find_clip(scene: &Scene, choice: &ClipChoice, side: &str, pointer: &str) -> Result<usize, SpecField> {
    let found = match choice {
        ClipChoice::Index(index) => (*index < scene.clips.len()).then_some(*index),
        ClipChoice::Name(name) => scene.clips.iter().position(|clip| clip.name() == name),
    };
    found.ok_or_else(|| {
        let names: Vec<&str> = scene.clips.iter().map(crate::model::Clip::name).collect();
        let (detail, name) = match (choice, names.len()) {
            (_, 0) => (format!("the {side} file has no clips"), ""),
            (ClipChoice::Index(index), 1) => {
                (format!("the {side} file has no clip {index}; it has one, which is clip 0: {}", list(&names)), "")
            }
            (ClipChoice::Index(index), count) => {
                let last = count - 1;
                (format!("the {side} file has no clip {index}; its clips are 0 to {last}: {}", list(&names)), "")
            }
            (ClipChoice::Name(name), _) => {
                (format!("the {side} file has no clip '{name}'; its clips are: {}", list(&names)), name.as_str())
            }
        };
        SpecField::new(SpecErrorKind::UnknownName, pointer, detail).with_nearest(name, names)
    })
}

/// Names for a message; a file may have hundreds.
pub(super) fn list(names: &[&str]) -> String {
    const MOST: usize = 12;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("'{name}'")).collect();
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    format!("{}{more}", shown.join(", "))
}
