//! Deviations, guesses and losses, collected as data.

use std::fmt;

/// Something that was guessed, repaired or lost, and that the user should know.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Stable, snake case, never renamed.
    pub code: &'static str,
    /// Where: a file's part, a joint, a JSON pointer. May be empty.
    pub place: String,
    /// What was seen and what was done about it.
    pub detail: String,
    /// What the user can do. May be empty.
    pub hint: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}: ", self.code)?;
        if !self.place.is_empty() {
            write!(formatter, "{}: ", self.place)?;
        }
        formatter.write_str(&self.detail)?;
        if !self.hint.is_empty() {
            write!(formatter, " ({})", self.hint)?;
        }
        Ok(())
    }
}

/// Collects warnings. One code is kept at most [`Reporter::MAX_PER_CODE`] times; the rest are counted.
#[derive(Clone, Debug, Default)]
pub struct Reporter {
    warnings: Vec<Warning>,
    left_out: Vec<(&'static str, usize)>,
}

impl Reporter {
    /// A hostile file could cause millions of the same warning; nobody reads past a few.
    pub const MAX_PER_CODE: usize = 20;

    /// A reporter with nothing in it.
    #[must_use]
    pub const fn new() -> Self {
        Self { warnings: Vec::new(), left_out: Vec::new() }
    }

    /// Adds a warning.
    pub fn warn(
        &mut self,
        code: &'static str,
        place: impl Into<String>,
        detail: impl Into<String>,
        hint: impl Into<String>,
    ) {
        if self.warnings.iter().filter(|warning| warning.code == code).count() < Self::MAX_PER_CODE {
            let warning = Warning { code, place: place.into(), detail: detail.into(), hint: hint.into() };
            self.warnings.push(warning);
        } else if let Some(entry) = self.left_out.iter_mut().find(|entry| entry.0 == code) {
            entry.1 += 1;
        } else {
            self.left_out.push((code, 1));
        }
    }

    /// What has been collected, in order, with a closing entry for each code that was cut.
    #[must_use]
    pub fn into_warnings(self) -> Vec<Warning> {
        let mut warnings = self.warnings;
        for (code, count) in self.left_out {
            warnings.push(Warning {
                code,
                place: String::new(),
                detail: format!("{count} more of these are not listed"),
                hint: String::new(),
            });
        }
        warnings
    }

    /// What has been collected so far.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }

    /// Puts a prefix before the place of every warning that comes from `inner`, and takes them over.
    pub fn absorb(&mut self, prefix: &str, inner: Self) {
        for warning in inner.into_warnings() {
            let place =
                if warning.place.is_empty() { prefix.to_owned() } else { format!("{prefix}: {}", warning.place) };
            self.warn(warning.code, place, warning.detail, warning.hint);
        }
    }
}
