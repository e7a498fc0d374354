//! Why a clip cannot be edited as asked.

use crate::model::ClipError;

/// Why a clip cannot be edited as asked. The pointer is a JSON pointer into the spec.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{detail}")]
pub struct EditError {
    /// The field that asks for what cannot be done.
    pub pointer: String,
    /// What cannot be done, and why.
    pub detail: String,
    /// What to do about it.
    pub hint: String,
}

impl EditError {
    pub(super) fn new(field: &str, detail: impl Into<String>, hint: impl Into<String>) -> Self {
        Self { pointer: format!("/edit/{field}"), detail: detail.into(), hint: hint.into() }
    }
}

impl From<ClipError> for EditError {
    fn from(error: ClipError) -> Self {
        Self {
            pointer: "/edit".into(),
            detail: format!("the edited clip would be none: {error}"),
            hint: "ask for times that rise by more than a rounding error".into(),
        }
    }
}
