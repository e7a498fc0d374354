//! Outputs with the keys that are needed, and no others.

use std::sync::Arc;

use crate::{
    editing::{Reduction, Tolerance, reduce_keys},
    formats::Format,
    model::{Clip, Control, Reporter},
    retarget::OutputSpec,
    rig::Rig,
};

use serde::Serialize;

use super::Failure;

/// How many keys an output needs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct KeysView {
    /// The output's format.
    pub format: &'static str,
    /// Keys of all tracks with a key per frame.
    pub keys_before: usize,
    /// Keys that were written of them.
    pub keys_after: usize,
    /// Bytes of those keys, times and values, with a key per frame.
    pub bytes_before: usize,
    /// Bytes of what was written.
    pub bytes_after: usize,
    /// The most that a point of the mesh moves by it, in millimeters.
    pub worst_millimeters: f64,
    /// The joint that the point is on.
    pub worst_joint: String,
    /// The frame in which it does.
    pub worst_frame: usize,
}

/// The clip with the keys that an output needs, and how many those are; nothing where it holds all.
pub(super) fn reduced(
    rig: &Rig<'_>,
    clip: &Clip,
    format: Format,
    options: &OutputSpec,
    control: &Control,
    reporter: &mut Reporter,
) -> Result<Option<(Clip, KeysView)>, Failure> {
    let Some(tolerance) = options.keys.tolerance() else { return Ok(None) };
    let all_are_needed = match format {
        format if format.holds_gltf() && rig.scene.stretched.is_none() => None,
        format if format.holds_gltf() => Some("joints hang below stretched nodes, whose every frame counts"),
        _ => Some("in this format all tracks share their key times, so every frame was written"),
    };
    if let Some(detail) = all_are_needed {
        let hint = "take a glTF format and a rig without stretched nodes, or leave output.keys out";
        reporter.warn("keys_all_written", format.info().name, detail, hint);
        return Ok(None);
    }
    let tolerance = Tolerance {
        distance: tolerance.distance_meters / rig.unit_meters,
        shell: tolerance.shell_meters / rig.unit_meters,
        interpolation: tolerance.interpolation,
    };
    let Reduction { keys, keys_before, bytes_before, worst } = reduce_keys(clip, rig.skeleton(), tolerance, control)?;
    let (distance, joint, frame) = worst;
    let view = KeysView {
        format: format.info().name,
        keys_before,
        keys_after: keys.count(),
        bytes_before,
        bytes_after: keys.bytes(),
        worst_millimeters: distance * rig.unit_meters * 1000.0,
        worst_joint: rig.skeleton().label(joint),
        worst_frame: frame,
    };
    Ok(Some((clip.clone().with_sparse_keys(Arc::new(keys)), view)))
}
