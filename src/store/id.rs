//! Ids: typed, unguessable, in the order of their making.

use std::fmt;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The text is no id of that kind.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("'{seen}' is not an id of this kind; one looks like {prefix}01j9…, 26 letters and digits after the prefix")]
pub struct IdError {
    /// What was seen.
    pub seen: String,
    /// What ids of the kind begin with.
    pub prefix: &'static str,
}

/// The alphabet keeps the order of the bytes, and leaves out letters that look alike.
const ALPHABET: &[u8; 32] = b"0123456789abcdefghjkmnpqrstvwxyz";
const LETTERS: usize = 26;

/// A version 7 UUID (time first, then 74 random bits) in base 32.
fn new_letters() -> String {
    letters_of(uuid::Uuid::now_v7().as_u128())
}

/// No id that is made then or later comes before it.
fn earliest_letters(milliseconds: i64) -> String {
    // The first 48 bits are the time.
    letters_of(u128::from(u64::try_from(milliseconds).unwrap_or(0) & ((1 << 48) - 1)) << 80)
}

fn letters_of(bits: u128) -> String {
    (0..LETTERS).rev().map(|place| char::from(ALPHABET[(bits >> (5 * place)) as usize & 31])).collect()
}

fn is_letters(text: &str) -> bool {
    text.len() == LETTERS && text.bytes().all(|byte| ALPHABET.contains(&byte))
}

macro_rules! id {
    ($(#[doc = $help:literal])+ $name:ident, $prefix:literal) => {
        $(#[doc = $help])+
        #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
        pub struct $name(String);

        impl $name {
            /// What ids of this kind begin with.
            pub const PREFIX: &'static str = $prefix;

            /// One that nobody has.
            #[must_use]
            pub fn new() -> Self {
                Self(format!("{}{}", $prefix, new_letters()))
            }

            /// Where ids begin that are made then (in milliseconds since 1970-01-01 UTC) or later.
            #[must_use]
            pub fn earliest(milliseconds: i64) -> Self {
                Self(format!("{}{}", $prefix, earliest_letters(milliseconds)))
            }

            /// Reads one.
            ///
            /// # Errors
            /// When the text is no id of this kind.
            pub fn parse(text: &str) -> Result<Self, IdError> {
                if text.strip_prefix($prefix).is_some_and(is_letters) {
                    return Ok(Self(text.to_owned()));
                }
                Err(IdError { seen: text.chars().take(64).collect(), prefix: $prefix })
            }

            /// The text.
            #[must_use]
            pub fn as_str(&self) -> &str {
                &self.0
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self::new()
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                formatter.write_str(&self.0)
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str(&self.0)
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                Self::parse(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
            }
        }
    };
}

id!(
    /// Names an uploaded file.
    AssetId,
    "ast_"
);
id!(
    /// Names a job.
    JobId,
    "job_"
);
id!(
    /// Names jobs that were asked for together.
    BatchId,
    "bat_"
);
id!(
    /// Names a file that a job gave.
    ResultId,
    "res_"
);
id!(
    /// Names a worker's hold on a job. Only who took the job knows it, so nobody else can write the job's end.
    LeaseId,
    "lse_"
);

id!(
    /// Names a key with which callers say who they are.
    ApiKeyId,
    "key_"
);

id!(
    /// Names a webhook.
    WebhookId,
    "whk_"
);
id!(
    /// Names something that a webhook is told.
    DeliveryId,
    "dlv_"
);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_read_back_and_keep_the_order_of_their_making() {
        let ids: Vec<JobId> = (0..1000).map(|_| JobId::new()).collect();
        assert!(ids.is_sorted_by(|a, b| a < b), "each is greater than the one before");
        assert_eq!(JobId::parse(ids[0].as_str()), Ok(ids[0].clone()), "reads back");
    }

    #[test]
    fn what_is_no_id_is_refused() {
        let asset = AssetId::new();
        for text in ["", "job_", "job_../../etc/passwd000000000", asset.as_str(), "job_0000000000000000000000000U"] {
            assert!(JobId::parse(text).is_err(), "{text:?}");
        }
    }
}
