//! What one file may cost, counted before it is paid.

use crate::model::{Canceled, Control};

use super::{ErrorKind, FormatError};

/// The limits that a file is read under. Every one of them is a setting of the service and listed at `/v1/limits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Limits {
    /// Bytes of one uploaded file.
    pub file_bytes: u64,
    /// Bytes that decoding one file may allocate in all (buffers, decompressed arrays, tracks). The file itself comes on top, so
    /// that with the defaults a process stays below one gibibyte.
    pub decoded_bytes: u64,
    /// Decoded bytes per encoded byte of one compressed part.
    pub decompression_ratio: u64,
    /// Nesting of a JSON document.
    pub json_depth: u64,
    /// Nodes of one file.
    pub nodes: u64,
    /// Joints below one another.
    pub hierarchy_depth: u64,
    /// Clips of one file.
    pub clips: u64,
    /// Key times of one clip.
    pub frames_per_clip: u64,
    /// Nodes times frames, over all clips of one file.
    pub samples: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            file_bytes: 256 << 20,
            decoded_bytes: 512 << 20,
            decompression_ratio: 200,
            json_depth: 64,
            nodes: 65_536,
            hierarchy_depth: 512,
            clips: 256,
            frames_per_clip: 216_000,
            samples: 50_000_000,
        }
    }
}

/// Names one of the [`Limits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// [`Limits::file_bytes`]
    FileBytes,
    /// [`Limits::decoded_bytes`]
    DecodedBytes,
    /// [`Limits::decompression_ratio`]
    DecompressionRatio,
    /// [`Limits::json_depth`]
    JsonDepth,
    /// [`Limits::nodes`]
    Nodes,
    /// [`Limits::hierarchy_depth`]
    HierarchyDepth,
    /// [`Limits::clips`]
    Clips,
    /// [`Limits::frames_per_clip`]
    FramesPerClip,
    /// [`Limits::samples`]
    Samples,
}

impl Limit {
    /// All of them, in the order of [`Limits`].
    pub const ALL: [Self; 9] = [
        Self::FileBytes,
        Self::DecodedBytes,
        Self::DecompressionRatio,
        Self::JsonDepth,
        Self::Nodes,
        Self::HierarchyDepth,
        Self::Clips,
        Self::FramesPerClip,
        Self::Samples,
    ];

    /// The name on the wire.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::FileBytes => "file_bytes",
            Self::DecodedBytes => "decoded_bytes",
            Self::DecompressionRatio => "decompression_ratio",
            Self::JsonDepth => "json_depth",
            Self::Nodes => "nodes",
            Self::HierarchyDepth => "hierarchy_depth",
            Self::Clips => "clips",
            Self::FramesPerClip => "frames_per_clip",
            Self::Samples => "samples",
        }
    }

    /// Its value in a set of limits.
    #[must_use]
    pub const fn of(self, limits: &Limits) -> u64 {
        match self {
            Self::FileBytes => limits.file_bytes,
            Self::DecodedBytes => limits.decoded_bytes,
            Self::DecompressionRatio => limits.decompression_ratio,
            Self::JsonDepth => limits.json_depth,
            Self::Nodes => limits.nodes,
            Self::HierarchyDepth => limits.hierarchy_depth,
            Self::Clips => limits.clips,
            Self::FramesPerClip => limits.frames_per_clip,
            Self::Samples => limits.samples,
        }
    }
}

/// Counts what reading one file costs, against its [`Limits`].
///
/// A reader calls [`Budget::take`] or [`Budget::check`] with what the file *declares*, before it allocates anything for it.
#[derive(Debug)]
pub struct Budget<'a> {
    limits: &'a Limits,
    control: &'a Control,
    decoded_bytes: u64,
    samples: u64,
}

impl<'a> Budget<'a> {
    /// A budget of which nothing is spent.
    #[must_use]
    pub const fn new(limits: &'a Limits, control: &'a Control) -> Self {
        Self { limits, control, decoded_bytes: 0, samples: 0 }
    }

    /// The limits themselves.
    #[must_use]
    pub const fn limits(&self) -> &'a Limits {
        self.limits
    }

    /// How much of [`Limits::decoded_bytes`] is spent.
    #[must_use]
    pub const fn decoded_bytes(&self) -> u64 {
        self.decoded_bytes
    }

    /// Where progress goes and cancellation comes from.
    #[must_use]
    pub const fn control(&self) -> &'a Control {
        self.control
    }

    /// To be called every few milliseconds of decoding.
    ///
    /// # Errors
    /// When the work has been canceled.
    pub fn check_canceled(&self) -> Result<(), Canceled> {
        self.control.check()
    }

    /// Spends `amount` of a limit. [`Limit::DecodedBytes`] and [`Limit::Samples`] add up over the file, the others are
    /// compared each by itself. `place` says where in the file the amount is asked for.
    ///
    /// # Errors
    /// When the limit does not allow it; nothing is spent then.
    pub fn take(&mut self, limit: Limit, amount: u64, place: &str) -> Result<(), FormatError> {
        let spent = match limit {
            Limit::DecodedBytes => &mut self.decoded_bytes,
            Limit::Samples => &mut self.samples,
            _ => return self.check(limit, amount, place),
        };
        let actual = spent.saturating_add(amount);
        let most = limit.of(self.limits);
        if actual > most {
            return Err(exceeded(limit, most, actual, place));
        }
        *spent = actual;
        Ok(())
    }

    /// Compares an amount with a limit without spending it.
    ///
    /// # Errors
    /// When the amount is larger.
    pub fn check(&self, limit: Limit, amount: u64, place: &str) -> Result<(), FormatError> {
        let most = limit.of(self.limits);
        if amount > most { Err(exceeded(limit, most, amount, place)) } else { Ok(()) }
    }

    /// Spends the decoded bytes of `count` elements of `size` bytes.
    ///
    /// # Errors
    /// When the limit does not allow it, or the product overflows.
    pub fn take_array(&mut self, count: u64, size: u64, place: &str) -> Result<(), FormatError> {
        self.take(Limit::DecodedBytes, count.saturating_mul(size), place)
    }
}

fn exceeded(limit: Limit, most: u64, actual: u64, place: &str) -> FormatError {
    FormatError {
        kind: ErrorKind::LimitExceeded { limit, most, actual },
        phase: "budget",
        place: place.to_owned(),
        detail: format!("the file asks for {actual} where the limit '{}' is {most}", limit.name()),
        hint: "make the file smaller, or ask the operator to raise the limit".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_add_up_and_maxima_do_not() {
        let limits = Limits { decoded_bytes: 10, nodes: 10, ..Limits::default() };
        let control = Control::new();
        let mut budget = Budget::new(&limits, &control);
        assert!(budget.take(Limit::DecodedBytes, 10, "").is_ok(), "at the limit");
        assert!(budget.take(Limit::DecodedBytes, 1, "").is_err(), "one past it");
        assert!(budget.take(Limit::Nodes, 10, "").is_ok(), "at the limit");
        assert!(budget.take(Limit::Nodes, 10, "").is_ok(), "compared by itself");
        assert!(budget.take_array(u64::MAX, 16, "").is_err(), "a product that overflows");
    }
}
