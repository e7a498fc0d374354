//! When the frames of a long clip are.

use std::ops::Range;

/// When the frames of a clip are, in seconds, rising.
#[derive(Clone, Debug, PartialEq)]
pub enum ClipTimes {
    /// Evenly spaced.
    Even {
        /// The time of the first.
        first_seconds: f64,
        /// From one to the next.
        step_seconds: f64,
        /// How many there are.
        frames: usize,
    },
    /// The time of each.
    Listed(Vec<f64>),
}

impl ClipTimes {
    /// Times of a file that holds them in single precision. They are taken to be even where none is farther from that than a thousandth of
    /// a frame, or than its own rounding: after ten hours a time is known to 4 milliseconds only.
    ///
    /// `None` when there is none, or they do not rise.
    pub(in crate::formats) fn of_keys(times: &[f32]) -> Option<Self> {
        let (first, last) = (f64::from(*times.first()?), f64::from(*times.last()?));
        if !times.iter().all(|time| time.is_finite()) || times.windows(2).any(|pair| pair[0] >= pair[1]) {
            return None;
        }
        let step = (last - first) / (times.len() - 1).max(1) as f64;
        let is_even = |(frame, time): (usize, &f32)| {
            let rounding = f64::from(time.abs()) * f64::from(f32::EPSILON);
            (first + frame as f64 * step - f64::from(*time)).abs() <= rounding.max(step * 1e-3)
        };
        if times.iter().enumerate().all(is_even) {
            return Some(Self::Even { first_seconds: first, step_seconds: step, frames: times.len() });
        }
        Some(Self::Listed(times.iter().copied().map(f64::from).collect()))
    }

    /// How many frames there are.
    #[must_use]
    pub const fn frames(&self) -> usize {
        match self {
            Self::Even { frames, .. } => *frames,
            Self::Listed(times) => times.len(),
        }
    }

    /// When a frame is.
    ///
    /// # Panics
    /// When it is past the end of times that are listed.
    #[must_use]
    pub fn seconds(&self, frame: usize) -> f64 {
        match self {
            Self::Even { first_seconds, step_seconds, .. } => first_seconds + frame as f64 * step_seconds,
            Self::Listed(times) => times[frame],
        }
    }

    /// When the frames of a section are, counted from its first.
    #[must_use]
    pub fn of_section(&self, frames: Range<usize>) -> Vec<f64> {
        match self {
            Self::Even { step_seconds, .. } => (0..frames.len()).map(|frame| frame as f64 * step_seconds).collect(),
            Self::Listed(times) => times[frames.clone()].iter().map(|time| time - times[frames.start]).collect(),
        }
    }

    /// From the first to the last.
    #[must_use]
    pub fn duration_seconds(&self) -> f64 {
        self.frames().checked_sub(1).map_or(0.0, |last| self.seconds(last) - self.seconds(0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_ten_hours_are_even_within_their_rounding() {
        let times: Vec<f32> = (0..2_160_000).map(|frame| (f64::from(frame) / 60.0) as f32).collect();
        let Some(ClipTimes::Even { step_seconds, frames, .. }) = ClipTimes::of_keys(&times) else {
            panic!("they are even")
        };
        assert_eq!(frames, times.len());
        assert!((step_seconds * 60.0 - 1.0).abs() < 1e-6, "sixty a second: {step_seconds}");
    }

    #[test]
    fn uneven_times_are_kept() {
        let times = ClipTimes::of_keys(&[0.5, 0.6, 1.0]).expect("they rise");
        assert!(matches!(times, ClipTimes::Listed(_)));
        let of_section = times.of_section(1..3);
        assert!(of_section[0].abs() < 1e-12 && (of_section[1] - 0.4).abs() < 1e-6, "{of_section:?}");
        assert_eq!(ClipTimes::of_keys(&[0.0, 0.0]), None, "they do not rise");
        assert_eq!(ClipTimes::of_keys(&[]), None, "there is none");
    }
}
