//! Who owns records.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};
use sha2::{Digest, Sha256};

use super::hexadecimal;

/// The text is no name of a principal.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{seen}' is not a caller name: 1 to {MAX_LETTERS} lower-case letters, digits, '_', '-' and '.'")]
pub struct PrincipalError {
    /// What was seen.
    pub seen: String,
}

const MAX_LETTERS: usize = 64;
/// What the names of those begin with who show tokens: no name of a key's holder has a colon.
const OF_TOKEN: &str = "token:";
/// What stands for a subject that cannot be a name. No subject that can has a colon.
const DIGEST: &str = "sha256:";
/// Letters of that digest: 192 bits.
const DIGEST_LETTERS: usize = 48;

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

    /// Who a token is about, by what its issuer calls them: the subject itself where it is short and plain, else a digest of it. Two
    /// subjects never have the same name, and none has the name of a key's holder.
    #[must_use]
    pub fn of_token(subject: &str) -> Self {
        if is_plain(subject) {
            return Self(format!("{OF_TOKEN}{subject}"));
        }
        let digest = hexadecimal(&Sha256::digest(subject.as_bytes()));
        Self(format!("{OF_TOKEN}{DIGEST}{}", &digest[..DIGEST_LETTERS]))
    }

    /// Reads what was written of a principal of any kind.
    ///
    /// # Errors
    /// When the text is no name of one.
    pub fn restore(text: &str) -> Result<Self, PrincipalError> {
        let is_digest = |text: &str| {
            text.len() == DIGEST_LETTERS
                && text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
        };
        match text.strip_prefix(OF_TOKEN) {
            Some(subject) if is_plain(subject) || subject.strip_prefix(DIGEST).is_some_and(is_digest) => {
                Ok(Self(text.to_owned()))
            }
            _ => Self::parse(text),
        }
    }

    /// Reads the name of a key's holder.
    ///
    /// # Errors
    /// When the text is none.
    pub fn parse(text: &str) -> Result<Self, PrincipalError> {
        let is_known = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"_-.".contains(&byte);
        if !text.is_empty() && text.len() <= MAX_LETTERS && text.bytes().all(is_known) {
            return Ok(Self(text.to_owned()));
        }
        Err(PrincipalError { seen: text.chars().take(MAX_LETTERS).collect() })
    }

    /// The name.
    #[must_use]
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

/// Whether a subject can be a name as it is.
fn is_plain(subject: &str) -> bool {
    let is_known = |byte: u8| byte.is_ascii_alphanumeric() || b"_-.@|+".contains(&byte);
    !subject.is_empty() && subject.len() <= MAX_LETTERS - OF_TOKEN.len() && subject.bytes().all(is_known)
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
        Self::restore(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subjects_of_tokens_have_names_of_their_own() {
        let long = "a".repeat(59);
        let subjects =
            ["ann", "Ann", "auth0|5f7c", "ann@studio.example", "anonymous", "ann smith", "änn", "token:ann", &long];
        let names: Vec<Principal> = subjects.map(Principal::of_token).into();
        let different: std::collections::BTreeSet<&Principal> = names.iter().collect();
        assert_eq!(different.len(), subjects.len(), "no two are the same: {names:?}");
        for name in &names {
            assert!(name.as_str().len() <= MAX_LETTERS, "{name} is short");
            assert!(Principal::parse(name.as_str()).is_err(), "{name} is no key's holder");
            assert_eq!(Principal::restore(name.as_str()).as_ref(), Ok(name), "is read as it was written");
        }
        let posing = Principal::of_token(names[5].as_str().trim_start_matches(OF_TOKEN));
        assert_ne!(posing, names[5], "a subject that looks like a digest is not taken for one");
    }

    #[test]
    fn what_was_never_written_is_not_read() {
        assert!(Principal::restore("studio").is_ok(), "a key's holder");
        for text in ["", "token:", "token:a b", "token:sha256:", "token:sha256:xyz", "other:ann", "Studio"] {
            assert!(Principal::restore(text).is_err(), "{text:?}");
        }
    }
}
