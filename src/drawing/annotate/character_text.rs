//! An annotation as the text of a character config.

use std::fmt::Write as _;

use super::AnnotatedJoint;

/// The character config of *Animated Drawings*: size and joints, in pixels.
pub(super) fn character_text([width, height]: [usize; 2], joints: &[AnnotatedJoint]) -> String {
    let mut text = format!("height: {height}\nskeleton:\n");
    for AnnotatedJoint { name, parent, place: [x, y], .. } in joints {
        let parent = parent.as_deref().unwrap_or("null");
        // Writing to a string cannot fail.
        let _ = write!(text, "- loc:\n  - {x}\n  - {y}\n  name: {name}\n  parent: {parent}\n");
    }
    let _ = writeln!(text, "width: {width}");
    text
}

/// The box of the figure in the picture, in pixels of the picture as it was given.
pub(super) fn bounds_text([left, top, right, bottom]: [usize; 4]) -> String {
    format!("bottom: {bottom}\nleft: {left}\nright: {right}\ntop: {top}\n")
}
