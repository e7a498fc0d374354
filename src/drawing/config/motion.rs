//! The config of a motion: which file, which of its frames, and how its body stands.

use serde::Deserialize;

use super::read;
use crate::drawing::error::DrawingError;

/// A motion.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionSpec {
    /// Path of the BVH.
    pub filepath: String,
    /// The first frame.
    #[serde(default)]
    pub start_frame_idx: usize,
    /// The frame after the last; nothing or 0 for all.
    #[serde(default)]
    pub end_frame_idx: Option<usize>,
    /// From one frame to the next in seconds, instead of what the file says.
    #[serde(default)]
    pub frame_time: Option<f64>,
    /// The joint that stands on the floor in the first frame.
    pub groundplane_joint: String,
    /// Pairs of joints from the body's left to its right, across its front.
    pub forward_perp_joint_vectors: Vec<[String; 2]>,
    /// What lengths of the file are multiplied with.
    pub scale: f64,
    /// Which axis is up.
    pub up: UpAxis,
}

/// Which axis of a motion is up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum UpAxis {
    /// +Y.
    #[serde(rename = "+y")]
    Y,
    /// +Z.
    #[serde(rename = "+z")]
    Z,
}

/// Reads the config of a motion.
///
/// # Errors
/// When it is no YAML, lacks what it needs, has a field that is not known, or holds a value that cannot be used.
pub fn read_motion(bytes: &[u8]) -> Result<MotionSpec, DrawingError> {
    let motion: MotionSpec = read(bytes, "the motion")?;
    if motion.forward_perp_joint_vectors.is_empty() {
        let detail = "there are no pairs of joints";
        let hint = "name at least one, such as [LeftShoulder, RightShoulder]";
        return Err(DrawingError::new("/forward_perp_joint_vectors", detail, hint));
    }
    let is_length = |value: f64| value > 0.0 && value.is_finite();
    if !is_length(motion.scale) {
        return Err(DrawingError::new("/scale", format!("{} is no scale above 0", motion.scale), ""));
    }
    if let Some(seconds) = motion.frame_time.filter(|seconds| !is_length(*seconds)) {
        return Err(DrawingError::new("/frame_time", format!("{seconds} is no time above 0"), ""));
    }
    if let Some(end) = motion.end_frame_idx.filter(|end| *end != 0 && *end <= motion.start_frame_idx) {
        let detail = format!("frame {end} is not after the first, {}", motion.start_frame_idx);
        return Err(DrawingError::new("/end_frame_idx", detail, "leave it out for all frames"));
    }
    Ok(motion)
}
