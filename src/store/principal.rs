//! Who owns records.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The text is no name of a principal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{seen}' is no name of a caller: 1 to {MOST_LETTERS} lower-case letters, digits, '_', '-' and '.'")]
pub struct PrincipalError {
    /// What was seen.
    pub seen: String,
}

const MOST_LETTERS: usize = 64;

/// One caller, or all callers of one team: whoever owns the files, jobs, rigs and presets that came with the same name. Principals
/// know nothing of one another.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Principal(String);

impl Principal {
    /// Everybody, where nobody has to say who they are.
    #[must_use]
    pub fn anonymous() -> Self {
        Self("anonymous".to_owned())
    }

    /// Reads a name.
    ///
    /// # Errors
    /// When the text is none.
    pub fn parse(text: &str) -> Result<Self, PrincipalError> {
        let is_known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_-.".contains(&byte);
        if !text.is_empty() && text.len() <= MOST_LETTERS && text.bytes().all(is_known) {
            return Ok(Self(text.to_owned()));
        }
        Err(PrincipalError { seen: text.chars().take(MOST_LETTERS).collect() })
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Principal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl Serialize for Principal {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(&self.0)
    }
}

impl<'de> Deserialize<'de> for Principal {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Self::parse(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}
