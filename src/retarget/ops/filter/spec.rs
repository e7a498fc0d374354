//! `filter`: takes noise off rotations.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::retarget::ops::Scope;

/// Takes noise off the local rotations of the target's driven joints. Mask: roles or limbs; default: all but the legs, whose feet
/// would leave their places.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
#[schemars(deny_unknown_fields)]
pub struct FilterOp {
    /// When and on what it works.
    #[serde(flatten)]
    pub scope: Scope,
    /// The kind of filter.
    pub kind: FilterKind,
    /// `bell`: its standard deviation. 0 to 1 second.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub seconds: f64,
    /// `one_euro`: what is let through while a joint rests. 0.01 to 100 Hz.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub min_frequency: f64,
    /// `one_euro`: how many Hz more for each radian per second. 0 to 100.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub responsiveness: f64,
    /// `savitzky_golay` and `median`: how many frames to each side are looked at; toward the ends of the clip as many as there are
    /// to both. 1 to 50.
    #[schemars(range(min = 1, max = 50))]
    pub reach_frames: u32,
    /// `savitzky_golay`: the degree of the polynomial; motion that is one of that degree passes unchanged. 1 to 5.
    #[schemars(range(min = 1, max = 5))]
    pub degree: u32,
    /// `butterworth`: of a swing of this frequency 1/√2 is left; at half the frame rate and above nothing is taken off. 0.01 to 1000 Hz.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub cutoff_hertz: f64,
}

impl Default for FilterOp {
    fn default() -> Self {
        Self {
            scope: Scope::default(),
            kind: FilterKind::default(),
            seconds: 0.03,
            min_frequency: 2.0,
            responsiveness: 0.5,
            reach_frames: 3,
            degree: 3,
            cutoff_hertz: 6.0,
        }
    }
}

/// A kind of filter. None delays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum FilterKind {
    /// A mean over time under a bell curve.
    #[default]
    Bell,
    /// The One-Euro filter, forward and backward: the slower a joint, the more is taken off.
    OneEuro,
    /// Savitzky and Golay's: the polynomial that meets the frames near each frame best. Keeps the height of peaks.
    SavitzkyGolay,
    /// Butterworth's low pass of the second order, forward and backward: what is slower than the cutoff stays, what is faster goes.
    Butterworth,
    /// The median of the frames near each frame, in place of it: spikes of up to `reach_frames` frames vanish, all else stays sharp.
    Median,
}
