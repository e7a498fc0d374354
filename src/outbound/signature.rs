//! Signatures of the Standard Webhooks scheme: HMAC-SHA256 over `id.timestamp.body` with a secret of the webhook's own.

use base64::{Engine as _, engine::general_purpose::STANDARD};
use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use crate::config::Secret;

/// What every secret begins with, so that people and scanners for leaked secrets know one when they see it.
const PREFIX: &str = "whsec_";
/// As many bits as the hash has; the scheme asks for 24 to 64 bytes.
const SECRET_BYTES: usize = 32;

/// The text is no secret of the scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a secret is '{PREFIX}' and base64 behind it")]
pub struct WebhookSecretError;

/// A secret that nobody has.
///
/// # Errors
/// When the system has no random bytes.
pub fn new_secret() -> Result<Secret, getrandom::Error> {
    let mut bytes = [0; SECRET_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(Secret(format!("{PREFIX}{}", STANDARD.encode(bytes))))
}

/// The header `webhook-signature`: one signature for each of the secrets, with spaces between them. `timestamp` is in seconds since
/// 1970, and is sent as `webhook-timestamp`.
///
/// # Errors
/// When one of the secrets is none.
pub fn signatures<'a>(
    secrets: impl IntoIterator<Item = &'a Secret>,
    id: &str,
    timestamp: i64,
    body: &str,
) -> Result<String, WebhookSecretError> {
    let signature = |secret: &Secret| {
        let text = secret.0.strip_prefix(PREFIX).ok_or(WebhookSecretError)?;
        let key = STANDARD.decode(text).map_err(|_| WebhookSecretError)?;
        let mut mac = Hmac::<Sha256>::new_from_slice(&key).map_err(|_| WebhookSecretError)?;
        for part in [id, ".", &timestamp.to_string(), ".", body] {
            mac.update(part.as_bytes());
        }
        Ok(format!("v1,{}", STANDARD.encode(mac.finalize().into_bytes())))
    };
    let signatures: Vec<String> = secrets.into_iter().map(signature).collect::<Result<_, _>>()?;
    Ok(signatures.join(" "))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The vector of the scheme's own documentation and libraries.
    #[test]
    fn the_published_vector_is_met() {
        let secret = Secret("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw".to_owned());
        let sign = |id: &str| signatures([&secret], id, 1_614_265_330, r#"{"test": 2432232314}"#);
        assert_eq!(
            sign("msg_p5jXN8AQM9LWM0D4loKWxJek").as_deref(),
            Ok("v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE="),
            "as published"
        );
        assert_ne!(sign("msg_other"), sign("msg_p5jXN8AQM9LWM0D4loKWxJek"), "the id is signed too");
    }

    #[test]
    fn every_secret_signs_by_itself_and_new_ones_differ() {
        let (new, old) = (new_secret().expect("random"), new_secret().expect("random"));
        assert!(new != old && new.0.starts_with("whsec_") && new.0.len() == 50, "a secret of its own");
        let both = signatures([&new, &old], "dlv_1", 7, "{}").expect("both are secrets");
        let alone = |secret| signatures([secret], "dlv_1", 7, "{}").expect("a secret");
        assert_eq!(both, format!("{} {}", alone(&new), alone(&old)), "each by itself, the new one first");
        for none in ["", "MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "whsec_***"] {
            assert_eq!(signatures([&Secret(none.to_owned())], "a", 0, ""), Err(WebhookSecretError), "{none:?}");
        }
    }
}
