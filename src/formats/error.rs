//! Why a file could not be read or written.

use crate::model::Canceled;

use super::Limit;

/// Why a file could not be read or written: what kind of reason, in which phase of decoding, where in the file, and what
/// the user can do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{detail}", place_prefix(place))]
pub struct FormatError {
    /// The kind of reason.
    pub kind: ErrorKind,
    /// What the reader was doing, such as `container`, `json`, `accessors`, `animation`.
    pub phase: &'static str,
    /// Byte offset, JSON pointer or line in the file. May be empty.
    pub place: String,
    /// What is wrong, naming the value that was seen.
    pub detail: String,
    /// What the user can do. May be empty.
    pub hint: String,
}

/// The kinds of reasons; each has one code on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorKind {
    /// The bytes are of no format that we know.
    UnsupportedFormat,
    /// The format is known, but the file needs a feature that we do not have.
    UnsupportedFeature,
    /// The file breaks the rules of its format.
    Malformed,
    /// The file asks for more than a limit allows.
    LimitExceeded {
        /// Which limit.
        limit: Limit,
        /// Its value.
        most: u64,
        /// What the file asks for.
        actual: u64,
    },
    /// The caller no longer wants it.
    Canceled,
}

impl FormatError {
    /// A file that breaks the rules of its format.
    #[must_use]
    pub fn malformed(phase: &'static str, place: impl Into<String>, detail: impl Into<String>) -> Self {
        Self {
            kind: ErrorKind::Malformed,
            phase,
            place: place.into(),
            detail: detail.into(),
            hint: "export the file again, or check it with a validator of its format".into(),
        }
    }

    /// A file that needs something that we do not have.
    #[must_use]
    pub fn unsupported(
        phase: &'static str,
        place: impl Into<String>,
        detail: impl Into<String>,
        hint: impl Into<String>,
    ) -> Self {
        Self {
            kind: ErrorKind::UnsupportedFeature,
            phase,
            place: place.into(),
            detail: detail.into(),
            hint: hint.into(),
        }
    }

    /// The same error with another hint.
    #[must_use]
    pub fn with_hint(self, hint: impl Into<String>) -> Self {
        Self { hint: hint.into(), ..self }
    }
}

impl From<Canceled> for FormatError {
    fn from(_: Canceled) -> Self {
        Self {
            kind: ErrorKind::Canceled,
            phase: "read",
            place: String::new(),
            detail: "the work was canceled".into(),
            hint: String::new(),
        }
    }
}

fn place_prefix(place: &str) -> String {
    if place.is_empty() { String::new() } else { format!("{place}: ") }
}
