//! Which frames of a motion file are shown, and where its body faces.

use serde::Deserialize;

use super::{
    DrawingError,
    yaml::{self, NotUsed, nullable},
};

/// Which axis of a motion file points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
pub enum UpAxis {
    /// +Y.
    #[serde(rename = "+y")]
    Y,
    /// +Z.
    #[serde(rename = "+z")]
    Z,
}

/// A motion file and how it is read.
#[derive(Clone, Debug, Deserialize)]
pub struct MotionSpec {
    /// The motion file.
    pub filepath: String,
    /// The first frame that is kept.
    #[serde(default, deserialize_with = "nullable")]
    pub start_frame_idx: usize,
    /// The frame after the last that is kept; none or 0 keeps all.
    #[serde(default)]
    pub end_frame_idx: Option<usize>,
    /// Seconds between frames, instead of the file's.
    #[serde(default)]
    pub frame_time: Option<f64>,
    /// The joint that stands on the floor at the first frame.
    pub groundplane_joint: String,
    /// Pairs of joints, from the body's left to its right.
    pub forward_perp_joint_vectors: Vec<(String, String)>,
    /// Factor from the lengths of the file.
    pub scale: f64,
    /// Which axis points up.
    pub up: UpAxis,
    #[serde(flatten)]
    not_used: NotUsed,
}

impl MotionSpec {
    /// Reads and checks the text of a motion config.
    ///
    /// # Errors
    ///
    /// With the place of what is wrong.
    pub fn read(text: &str) -> Result<Self, DrawingError> {
        let spec: Self = yaml::parse(text)?;
        if !(spec.scale.is_finite() && spec.scale > 0.0) {
            return Err(DrawingError::new("scale", format!("{}", spec.scale), "give a number greater than 0"));
        }
        if spec.frame_time.is_some_and(|time| !(time.is_finite() && time > 0.0)) {
            return Err(DrawingError::new("frame_time", "not greater than 0", "give seconds, or leave it out"));
        }
        if spec.forward_perp_joint_vectors.is_empty() {
            let fix = "name a joint of the left side and one of the right side";
            return Err(DrawingError::new("forward_perp_joint_vectors", "there is no pair", fix));
        }
        Ok(spec)
    }

    /// The frames that are kept of so many.
    ///
    /// # Errors
    ///
    /// Where none is left.
    pub fn frames(&self, count: usize) -> Result<std::ops::Range<usize>, DrawingError> {
        let end = self.end_frame_idx.filter(|&end| end > 0).unwrap_or(count).min(count);
        if self.start_frame_idx >= end {
            let detail = format!("frames {} to {end} of {count} are none", self.start_frame_idx);
            return Err(DrawingError::new("start_frame_idx", detail, "start before the end"));
        }
        Ok(self.start_frame_idx..end)
    }

    /// The fields that nothing reads.
    #[must_use]
    pub fn not_used(&self) -> Vec<String> {
        self.not_used.keys().cloned().collect()
    }
}
