//! Files from places that callers name.

use bytes::Bytes;
use reqwest::{Response, Url, header};

use super::{Outbound, SendError, client::send_error};

/// How often a place may send the service on, each time to one that is checked as the first.
pub const MAX_REDIRECTS: usize = 3;

/// Why there is no file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FetchError {
    /// There is no answer.
    #[error(transparent)]
    Send(#[from] SendError),
    /// The answer is no file.
    #[error("the answer was {0}")]
    Status(u16),
    /// It is always somewhere else.
    #[error("there were too many redirects")]
    TooManyRedirects,
}

/// A file that arrives. Dropping it breaks it off.
#[derive(Debug)]
pub struct Download {
    response: Response,
    /// What its URL ends with. May be empty.
    pub name: String,
    /// How long it says that it is.
    pub announced_bytes: Option<u64>,
}

impl Download {
    /// The next bytes; nothing at its end. How long this takes, and how much there is, is for the caller to bound.
    ///
    /// # Errors
    /// When it breaks off.
    pub async fn next(&mut self) -> Result<Option<Bytes>, FetchError> {
        Ok(self.response.chunk().await.map_err(|error| send_error(&error))?)
    }
}

impl Outbound {
    /// Begins to fetch a file, over at most [`MAX_REDIRECTS`] redirects. How long this takes is for the caller to bound.
    ///
    /// # Errors
    /// When there is none, or the way leads where the service does not go.
    pub async fn fetch(&self, url: &str) -> Result<Download, FetchError> {
        let mut url = self.checked(url)?;
        for _ in 0..=MAX_REDIRECTS {
            let response = self.client(&url)?.get(url.clone()).send().await.map_err(|error| send_error(&error))?;
            let status = response.status();
            if status.is_success() {
                return Ok(Download { name: file_name(&url), announced_bytes: response.content_length(), response });
            }
            if !matches!(status.as_u16(), 301 | 302 | 303 | 307 | 308) {
                return Err(FetchError::Status(status.as_u16()));
            }
            let location = response.headers().get(header::LOCATION).and_then(|value| value.to_str().ok());
            let next = location.and_then(|location| url.join(location).ok()).ok_or(FetchError::TooManyRedirects)?;
            url = self.checked(next.as_str())?;
        }
        Err(FetchError::TooManyRedirects)
    }
}

/// The last piece of a path, which is of ASCII without control characters. The ending tells formats apart, so of a long one it is the
/// beginning that goes.
fn file_name(url: &Url) -> String {
    const MAX_LETTERS: usize = 200;
    let last = url.path_segments().and_then(|mut pieces| pieces.next_back()).unwrap_or_default();
    last.get(last.len().saturating_sub(MAX_LETTERS)..).unwrap_or_default().to_owned()
}
