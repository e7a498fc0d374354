//! Files that the service gets itself, from a URL that a caller names.
//!
//! Off unless the operator says otherwise. What arrives is held to the limits of uploads, and leaves nothing when it breaks off.

use super::{AssetRecord, Assets, Refusal};
use crate::{
    outbound::{FetchError, MAX_REDIRECTS, SendError},
    store::Principal,
};

/// A file that is to be fetched.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NewFetch {
    /// Where it is.
    pub url: String,
    /// What it is called; as its URL ends, where nothing is said.
    pub file_name: Option<String>,
    /// The SHA-256 that its bytes must have, in hexadecimal.
    pub digest: Option<String>,
}

impl Assets {
    /// Fetches a file and keeps it as if it had been uploaded. Gives the record and whether it is new.
    ///
    /// # Errors
    /// When this is off, the URL or a redirect leads where the service does not go, the file does not arrive in time, or it would be refused
    /// as an upload.
    pub async fn fetch(&self, owner: &Principal, wanted: NewFetch) -> Result<(AssetRecord, bool), Refusal> {
        let settings = &self.jobs.0.settings;
        if !settings.url_input.0 {
            return Err(Refusal::UrlInputOff);
        }
        let fetching = tokio::time::timeout(settings.url_input_timeout.0, self.fetch_now(owner, wanted));
        fetching.await.unwrap_or(Err(Refusal::FetchFailed { reason: "it took too long".to_owned() }))
    }

    async fn fetch_now(&self, owner: &Principal, wanted: NewFetch) -> Result<(AssetRecord, bool), Refusal> {
        let _slot = self.fetches.acquire().await;
        let mut file = self.outbound.fetch(&wanted.url).await.map_err(refusal)?;
        let name = wanted.file_name.as_deref().unwrap_or(&file.name);
        let mut upload = self.begin(name, file.announced_bytes).await?;
        while let Some(chunk) = file.next().await.map_err(refusal)? {
            upload.write(&chunk).await?;
        }
        let received = upload.finish(wanted.digest.as_deref()).await?;
        self.keep(owner, received).await
    }
}

fn refusal(error: FetchError) -> Refusal {
    let reason = match error {
        FetchError::Send(SendError::Blocked(blocked)) => return Refusal::ForbiddenUrl(blocked),
        FetchError::Send(error) => error.to_string(),
        FetchError::Status(status) => format!("the answer was {status}"),
        FetchError::TooManyRedirects => format!("it was redirected more than {MAX_REDIRECTS} times, or to no URL"),
    };
    Refusal::FetchFailed { reason }
}
