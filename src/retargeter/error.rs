//! Why a program did not get what it asked for.

use std::fmt;

use crate::engine::{Failure, FailureCode, FieldError};

/// Why there is no result. Displays which input is to blame; [`source()`](std::error::Error::source) says what is wrong with it, and
/// [`Self::hint`] what to do.
///
/// ```
/// use std::error::Error as _;
/// use retargetd::{Asset, FailureCode, Retargeter, samples};
///
/// let walk = samples::walk_clip();
/// let error = Retargeter::new().retarget(Asset::new("walk.glb", &walk), Asset::new("hero.fbx", b"?")).unwrap_err();
/// assert_eq!(error.code(), FailureCode::UnsupportedFormat);
/// assert_eq!(error.to_string(), "the target cannot be used");
/// assert!(error.source().is_some());
/// ```
#[derive(Clone, PartialEq, Eq)]
pub struct Error(Box<Failure>);

impl Error {
    /// A stable code.
    #[must_use]
    pub fn code(&self) -> FailureCode {
        self.0.code
    }

    /// Which input it is about: `source`, `target`, `source_rest`, `target_rest`, `config`; empty where it is about none.
    #[must_use]
    pub fn part(&self) -> &'static str {
        self.0.part
    }

    /// Where in that input; may be empty.
    #[must_use]
    pub fn place(&self) -> &str {
        &self.0.place
    }

    /// What is wrong, naming the value that was seen.
    #[must_use]
    pub fn detail(&self) -> &str {
        &self.0.detail
    }

    /// What the user can do; may be empty.
    #[must_use]
    pub fn hint(&self) -> &str {
        &self.0.hint
    }

    /// Every single thing that is wrong with a config.
    #[must_use]
    pub fn fields(&self) -> &[FieldError] {
        &self.0.errors
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.0.code, self.0.part) {
            (FailureCode::Canceled, _) => formatter.write_str("the retarget was canceled"),
            (FailureCode::StrictWarnings | FailureCode::StrictMeasures, _) => {
                formatter.write_str("the result is not good enough for a strict config")
            }
            (_, "") => formatter.write_str("the retarget failed"),
            (_, part) => write!(formatter, "the {} cannot be used", part.replace('_', " ")),
        }
    }
}

/// What `main` prints when it returns the error: all of it.
impl fmt::Debug for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Failure { code, detail, place, hint, errors, .. } = &*self.0;
        write!(formatter, "{self}: ")?;
        if !place.is_empty() && !detail.starts_with(place.as_str()) {
            write!(formatter, "{place}: ")?;
        }
        write!(formatter, "{detail} [{}]", code.name())?;
        for field in errors {
            write!(formatter, "\n  {}: {}", field.pointer, field.detail)?;
        }
        if hint.is_empty() { Ok(()) } else { write!(formatter, "\n  hint: {hint}") }
    }
}

impl std::error::Error for Error {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        Some(&*self.0)
    }
}

impl<E: Into<Failure>> From<E> for Error {
    fn from(error: E) -> Self {
        Self(Box::new(error.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn debug_has_the_input_the_field_and_the_hint() {
        let field = FieldError {
            pointer: "/ops/0".into(),
            code: "invalid_value".into(),
            detail: "too large".into(),
            did_you_mean: Vec::new(),
        };
        let failure = Failure::new(FailureCode::InvalidValue, "one value is wrong").in_part("source_rest");
        let error = Error::from(failure.with_hint("make it smaller").with_errors(vec![field]));
        assert_eq!(
            format!("{error:?}"),
            "the source rest cannot be used: one value is wrong [invalid_value]\n  /ops/0: too large\n  hint: make it smaller"
        );
        assert_eq!(std::error::Error::source(&error).map(ToString::to_string).as_deref(), Some("one value is wrong"));
    }
}
