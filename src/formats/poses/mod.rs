//! Pose arrays: a skeleton and at most one clip as plain arrays, in a NumPy archive or in JSON.
//!
//! | key | shape | |
//! |---|---|---|
//! | `joint_names` | J | strings |
//! | `parents` | J | −1 for a root; parents before children |
//! | `rest_translations`, `rest_rotations`, `rest_scales` | J×3, J×4, J×3 | local; rotations (identity) and scales (one) may be absent |
//! | `times` | F | seconds, rising; may be absent when `meta` has `fps`: then frame k is at k / fps |
//! | `translations`, `rotations`, `scales` | F×J×3, F×J×4, F×J×3 | local; an absent channel stays at rest |
//! | `contacts`, `contact_joints` | F×C bool, C | where contacts are known: when those joints rest on something |
//! | `morph_names`, `morph_weights` | M, F×M | the weights of morph targets and expressions; without a mesh that they move |
//! | `meta` | JSON string | `name`, `fps`, `axes` (up and front, default `+y+z`), `unit` in meters (default 1) |
//!
//! Both codecs decode into the same [`arrays::Arrays`]; [`read`] is the only place that knows what the arrays mean. Nothing
//! is converted: the scene stays in the axes and the unit that `meta` declares.

mod arrays;
mod json;
mod npz;
mod read;
mod read_beside;
mod write;

use crate::{
    formats::{Budget, Format, FormatError, WriteOptions},
    model::{Clip, Control, Reporter, Scene},
};

/// Decodes pose arrays; `format` says in which of the two codecs they come.
///
/// The scene has all joints with `is_joint`, axes and unit as `meta` declares (`+y+z` and 1 when it does not), and one clip,
/// or none when there are no frames.
///
/// # Errors
/// When the container or an array breaks the rules of the layout, holds a value that is not finite, or is larger than the
/// budget allows; when the archive follows another layout (AMASS).
pub(super) fn read(
    bytes: &[u8],
    format: Format,
    budget: &mut Budget<'_>,
    reporter: &mut Reporter,
) -> Result<Scene, FormatError> {
    let arrays = match format {
        Format::PosesJson => json::read(bytes, budget)?,
        _ => npz::read(bytes, budget)?,
    };
    read::scene(arrays, budget, reporter)
}

/// Encodes a clip of `target` as pose arrays, every channel of every joint sampled at every frame.
///
/// The joints are those that the target's file calls joints, with everything above them; all nodes where it calls none so.
/// Axes and unit are the target's own. The same input gives the same bytes.
///
/// # Errors
/// When the target has no node at all, when the archive cannot hold that much, or when the work is canceled.
pub(super) fn write(
    target: &Scene,
    clip: &Clip,
    options: &WriteOptions,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Vec<u8>, FormatError> {
    let poses = write::Poses::new(target, clip, options, reporter)?;
    match options.format {
        Format::PosesJson => json::write(&poses, control),
        _ => npz::write(&poses, control),
    }
}

#[cfg(test)]
mod tests;
