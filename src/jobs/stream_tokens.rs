//! Tokens that open event streams for a minute: browsers' `EventSource` sends no headers, and a key does not belong into an address.
//!
//! A token is `rts_<id>_<end>_<signature>`: the id of the key that it was made with, when it ends, and an HMAC over both. What signs is the
//! digest of the key's secret, which only the database knows: any process can check a token, none has to keep one, and it ends with its key.

use std::time::Duration;

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;
use subtle::ConstantTimeEq;

use super::{KeyText, Keys, Refusal};
use crate::store::{ApiKeyId, ApiKeyRecord, hexadecimal};

const PREFIX: &str = "rts_";
/// Long enough to open a stream with, too short for logs of proxies to matter.
const LIFETIME: Duration = Duration::from_secs(60);

/// A token, and when it ends.
#[derive(Clone, Debug)]
pub struct StreamToken {
    /// What goes into the address.
    pub text: KeyText,
    /// After that it opens nothing; streams that it has opened go on.
    pub expires_at: jiff::Timestamp,
}

impl Keys {
    /// Makes a token for the holder of a key.
    #[must_use]
    pub fn stream_token(&self, key: &ApiKeyRecord) -> StreamToken {
        let expires_at = self.clock().after(LIFETIME);
        let letters = key.id.as_str().trim_start_matches(ApiKeyId::PREFIX);
        let end = expires_at.as_millisecond();
        let text = format!("{PREFIX}{letters}_{end}_{}", signature(key, end));
        StreamToken { text: KeyText::of(text), expires_at }
    }

    /// The key that a token was made with; `None` when it is none, has ended, or its key is not good any more.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn check_stream_token(&self, text: &str) -> Result<Option<ApiKeyRecord>, Refusal> {
        let Some((id, end, shown)) = parts(text) else { return Ok(None) };
        let now = self.clock().now();
        if end <= now.as_millisecond() {
            return Ok(None);
        }
        let key = self.good_key(&id, now).await?;
        let is_signed = |key: &ApiKeyRecord| bool::from(signature(key, end).as_bytes().ct_eq(shown.as_bytes()));
        Ok(key.filter(is_signed))
    }
}

fn parts(text: &str) -> Option<(ApiKeyId, i64, &str)> {
    let mut parts = text.strip_prefix(PREFIX)?.splitn(3, '_');
    let id = ApiKeyId::parse(&format!("{}{}", ApiKeyId::PREFIX, parts.next()?)).ok()?;
    Some((id, parts.next()?.parse().ok()?, parts.next()?))
}

/// What nobody can write who does not know the digest of the key's secret.
fn signature(key: &ApiKeyRecord, end: i64) -> String {
    // Keys of an HMAC may have any length.
    let Ok(mac) = Hmac::<Sha256>::new_from_slice(key.sha256.as_bytes()) else { return String::new() };
    let signed = mac.chain_update(format!("event stream {} {end}", key.id).as_bytes());
    hexadecimal(&signed.finalize().into_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        jobs::NewKey,
        store::{Principal, Records, Scope},
        telemetry::Clock,
    };

    #[tokio::test]
    async fn a_token_opens_for_a_minute_and_only_as_it_was_made() {
        let folder = tempfile::tempdir().expect("a folder");
        let records = Records::open(&folder.path().join("state.db")).await.expect("opens");
        let clock = Clock::system();
        let keys = Keys::new(records, clock.clone());
        let principal = Principal::parse("ann").expect("a name");
        let (_, key) = keys
            .create(NewKey { principal, scopes: vec![Scope::Read], lifetime: None, note: String::new() })
            .await
            .expect("is made");
        let token = keys.stream_token(&key).text.reveal().to_owned();
        let opens = async |text: &str| keys.check_stream_token(text).await.expect("is looked up").is_some();
        assert!(opens(&token).await, "as it was made");
        let (start, signed) = token.rsplit_once('_').expect("a signature");
        let (id, end) = start.rsplit_once('_').expect("an end");
        let later = end.parse::<i64>().expect("a number") + 1;
        for wrong in [
            format!("{id}_{later}_{signed}"),
            format!("{start}_"),
            format!("{start}_{}", "0".repeat(64)),
            String::new(),
        ] {
            assert!(!opens(&wrong).await, "{wrong}");
        }
        clock.advance(LIFETIME);
        assert!(!opens(&token).await, "it has ended");
        let token = keys.stream_token(&key).text.reveal().to_owned();
        keys.revoke(&key.id).await.expect("is revoked");
        assert!(!opens(&token).await, "and it ends with its key");
    }
}
