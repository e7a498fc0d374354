//! Why tokens are refused, and why keys are not there.

use std::{io, path::PathBuf};

/// Why a token opens nothing. The texts say nothing that the token's holder does not know, and are told to the holder.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TokenError {
    /// It has not the shape of a signed token, or is signed in a way that nobody knows.
    #[error("it is not a signed token (JWT) of a kind that is accepted")]
    Malformed,
    /// It asks for something that must be understood and is not.
    #[error("its header asks for an extension that is not understood")]
    Extension,
    /// It is signed in a way that the operator does not allow.
    #[error("it is signed with {0}, which is not taken here")]
    Algorithm(&'static str),
    /// The issuer has no such key.
    #[error("the issuer has no key that it could be signed with")]
    UnknownKey,
    /// The signature is not that of the key.
    #[error("its signature is not that of the issuer")]
    Signature,
    /// It is over.
    #[error("it has expired")]
    Expired,
    /// It has not begun.
    #[error("it is not valid yet")]
    NotYet,
    /// Somebody else made it.
    #[error("it is of another issuer")]
    Issuer,
    /// It is meant for another service.
    #[error("it is for another audience")]
    Audience,
    /// A claim that is needed is not there, or is of the wrong type.
    #[error("it has no claim '{0}' that can be used")]
    Claim(String),
    /// There is nothing to check it with.
    #[error("it cannot be checked, since the keys of the issuer are not available")]
    Unavailable,
}

/// Why the keys of the issuer are not there.
#[derive(Debug, thiserror::Error)]
pub enum KeysError {
    /// The file cannot be read.
    #[error("the file '{}' with the token issuer's keys cannot be read: {source}; --token-keys names it", path.display())]
    File {
        /// Its path.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The URL gives no answer that can be used.
    #[error("'{url}' of the token issuer does not answer: {reason}")]
    Fetch {
        /// The URL.
        url: String,
        /// Why.
        reason: String,
    },
    /// The document is not what it should be.
    #[error("'{place}' of the token issuer cannot be used: {reason}")]
    Document {
        /// Where it came from.
        place: String,
        /// What is wrong with it.
        reason: String,
    },
}
