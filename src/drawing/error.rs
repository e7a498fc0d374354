//! What is wrong with a drawing or one of its configs.

use std::fmt;

/// What is wrong, where, and how it is put right.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DrawingError {
    /// The file, and the field within it.
    pub place: String,
    /// What is wrong.
    pub detail: String,
    /// What to do about it; may be empty.
    pub fix: String,
}

impl DrawingError {
    /// An error at a place.
    pub fn new(place: impl Into<String>, detail: impl Into<String>, fix: impl Into<String>) -> Self {
        Self { place: place.into(), detail: detail.into(), fix: fix.into() }
    }

    /// A name that is not among those there are.
    pub(super) fn unknown_name(place: impl Into<String>, name: &str, known: &[String]) -> Self {
        let shown = known.iter().take(40).map(String::as_str).collect::<Vec<_>>().join(", ");
        Self::new(place, format!("there is no joint {name:?}"), format!("name one of: {shown}"))
    }

    /// The same error in a named file.
    #[must_use]
    pub fn in_file(self, file: &str) -> Self {
        Self { place: format!("{file}: {}", self.place), ..self }
    }
}

impl fmt::Display for DrawingError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: {}", self.place, self.detail)
    }
}

impl std::error::Error for DrawingError {}
