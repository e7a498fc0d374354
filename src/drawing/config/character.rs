//! The config of a character: the size of its pictures, and its joints.

use std::collections::BTreeSet;

use serde::Deserialize;

use super::read;
use crate::drawing::error::DrawingError;

/// Joints of one character.
const MAX_JOINTS: usize = 128;

/// A drawn character.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CharacterSpec {
    /// Of texture and mask, in pixels.
    pub width: u32,
    /// Of texture and mask, in pixels.
    pub height: u32,
    /// Its joints; one of them is called `root` and has no parent.
    pub skeleton: Vec<SkeletonJoint>,
}

/// A joint of a drawing.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkeletonJoint {
    /// Column and row in pixels, from the upper left corner.
    pub loc: [f64; 2],
    /// Its name.
    pub name: String,
    /// The joint that it hangs on.
    pub parent: Option<String>,
}

/// Reads the config of a character.
///
/// # Errors
/// When it is no YAML, lacks what it needs, or its joints are no tree below one joint `root` within the picture.
pub fn read_character(bytes: &[u8]) -> Result<CharacterSpec, DrawingError> {
    let character: CharacterSpec = read(bytes, "the character")?;
    let CharacterSpec { width, height, skeleton } = &character;
    if *width == 0 || *height == 0 || *width > 16_384 || *height > 16_384 {
        return Err(DrawingError::new("/width", format!("a picture of {width} by {height} pixels is none"), ""));
    }
    if skeleton.len() > MAX_JOINTS {
        let detail = format!("{} joints are more than the {MAX_JOINTS} that a drawing may have", skeleton.len());
        return Err(DrawingError::new("/skeleton", detail, "leave some out"));
    }
    let mut names = BTreeSet::new();
    for (index, joint) in skeleton.iter().enumerate() {
        let place = |field: &str| format!("/skeleton/{index}/{field}");
        if !names.insert(joint.name.as_str()) {
            return Err(DrawingError::new(place("name"), format!("there are two joints '{}'", joint.name), ""));
        }
        let [x, y] = joint.loc;
        if !(0.0..f64::from(*width)).contains(&x) || !(0.0..f64::from(*height)).contains(&y) {
            let detail = format!("[{x}, {y}] is not in the picture of {width} by {height} pixels");
            return Err(DrawingError::new(place("loc"), detail, ""));
        }
    }
    if skeleton.iter().filter(|joint| joint.parent.is_none()).map(|joint| joint.name.as_str()).ne(["root"]) {
        let detail = "one joint has no parent, and it is called 'root'";
        return Err(DrawingError::new("/skeleton", detail, ""));
    }
    for (index, joint) in skeleton.iter().enumerate() {
        let mut above = joint.parent.as_deref();
        for _ in 0..=skeleton.len() {
            let Some(name) = above else { break };
            let Some(parent) = skeleton.iter().find(|other| other.name == name) else {
                let known = skeleton.iter().map(|other| other.name.as_str());
                return Err(DrawingError::unknown(format!("/skeleton/{index}/parent"), "joint", name, known));
            };
            above = parent.parent.as_deref();
        }
        if above.is_some() {
            let detail = format!("'{}' hangs on itself", joint.name);
            return Err(DrawingError::new(format!("/skeleton/{index}/parent"), detail, ""));
        }
    }
    Ok(character)
}
