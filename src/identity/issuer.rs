//! Where an issuer's keys are, and fetching them.

use std::time::Duration;

use reqwest::{Client, redirect};
use serde::Deserialize;

use super::{error::KeysError, key_set::KeySet};
use crate::config::{KeyPlace, Settings, is_guarded_url, is_this_machine};

/// How long one answer may take.
const TIMEOUT: Duration = Duration::from_secs(5);
/// More than any issuer has to say.
const MAX_BYTES: usize = 1 << 20;

/// Who signs tokens.
#[derive(Debug)]
pub(super) struct Issuer {
    name: String,
    place: KeyPlace,
    client: Client,
}

impl Issuer {
    /// The one that the settings name.
    ///
    /// # Errors
    /// When no connections can be made at all.
    pub(super) fn new(settings: &Settings) -> Result<Self, KeysError> {
        let (name, place) = (settings.token_issuer.clone(), settings.token_keys.clone());
        let url = if let KeyPlace::Url(url) = &place { url } else { &name };
        // A redirect could lead to where somebody else answers.
        let builder = Client::builder().timeout(TIMEOUT).redirect(redirect::Policy::none());
        let builder = if is_this_machine(url) { builder.no_proxy() } else { builder };
        let client = builder.build().map_err(|error| fetch_error(url, error))?;
        Ok(Self { name, place, client })
    }

    /// Whether it may answer later although it does not now.
    pub(super) const fn may_come_back(&self) -> bool {
        !matches!(self.place, KeyPlace::File(_))
    }

    /// Its keys as they are now.
    ///
    /// # Errors
    /// When it does not answer, or with nothing that can be used.
    pub(super) async fn keys(&self) -> Result<KeySet, KeysError> {
        let (place, text) = match &self.place {
            KeyPlace::File(path) => {
                let read = tokio::fs::read(path).await;
                let text = read.map_err(|source| KeysError::File { path: path.clone(), source })?;
                (path.display().to_string(), text)
            }
            KeyPlace::Url(url) => (url.clone(), self.fetch(url).await?),
            KeyPlace::Discovered => {
                let url = self.discover().await?;
                let text = self.fetch(&url).await?;
                (url, text)
            }
        };
        KeySet::parse(&text).map_err(|reason| KeysError::Document { place, reason })
    }

    /// Where its discovery document says that its keys are (OpenID Connect Discovery 1.0, section 4).
    async fn discover(&self) -> Result<String, KeysError> {
        #[derive(Deserialize)]
        struct Discovery {
            issuer: String,
            jwks_uri: String,
        }
        let url = format!("{}/.well-known/openid-configuration", self.name.trim_end_matches('/'));
        let text = self.fetch(&url).await?;
        let unusable = |reason: String| KeysError::Document { place: url.clone(), reason };
        let found: Discovery = serde_json::from_slice(&text).map_err(|error| unusable(error.to_string()))?;
        if found.issuer != self.name {
            return Err(unusable(format!("it is of the issuer '{}', and not '{}'", found.issuer, self.name)));
        }
        if !is_guarded_url(&found.jwks_uri) {
            return Err(unusable(format!("the keys are at '{}', which is not an https URL", found.jwks_uri)));
        }
        Ok(found.jwks_uri)
    }

    async fn fetch(&self, url: &str) -> Result<Vec<u8>, KeysError> {
        let failed = |error| fetch_error(url, error);
        let mut answer = self.client.get(url).send().await.map_err(failed)?.error_for_status().map_err(failed)?;
        let unusable = |reason: &str| KeysError::Document { place: url.to_owned(), reason: reason.to_owned() };
        // A redirect that is not followed is no error of the status.
        if !answer.status().is_success() {
            return Err(unusable("it leads elsewhere; give the place itself"));
        }
        let mut text = Vec::new();
        while let Some(bytes) = answer.chunk().await.map_err(failed)? {
            if text.len() + bytes.len() > MAX_BYTES {
                return Err(unusable("it is larger than 1 MiB"));
            }
            text.extend_from_slice(&bytes);
        }
        Ok(text)
    }
}

/// The error with what lies behind it: that is where the reason is.
fn fetch_error(url: &str, error: reqwest::Error) -> KeysError {
    let error = anyhow::Error::new(error.without_url());
    KeysError::Fetch { url: url.to_owned(), reason: format!("{error:#}") }
}
