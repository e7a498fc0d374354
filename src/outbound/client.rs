//! Requests to places that callers name.

use std::{
    error::Error,
    sync::{Arc, OnceLock},
    time::Duration,
};

use reqwest::{Client, Url, header, redirect::Policy};

use super::{
    Blocked,
    guard::{Guard, GuardedResolver, Reach},
    retry_after,
};
use crate::{config::Settings, telemetry::Clock};

/// What a receiver answered. Its body is not read: nothing in it could matter, and it could be endless.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// The HTTP status.
    pub status: u16,
    /// How long it wants to be left alone.
    pub retry_after: Option<Duration>,
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// The service does not talk to that place.
    #[error(transparent)]
    Blocked(#[from] Blocked),
    /// It took too long.
    #[error("it took too long")]
    TimedOut,
    /// No connection, no TLS, or no HTTP.
    #[error("it cannot be reached")]
    Unreachable,
}

impl SendError {
    /// A word for records, of a closed set.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Blocked(_) => "forbidden_address",
            Self::TimedOut => "timeout",
            Self::Unreachable => "unreachable",
        }
    }
}

/// Talks to places that callers name. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Outbound(Arc<Inner>);

#[derive(Debug)]
struct Inner {
    guard: Arc<Guard>,
    clock: Clock,
    /// For `https`.
    secure: OnceLock<Client>,
    /// For `http`.
    plain: OnceLock<Client>,
}

impl Outbound {
    /// Talks where the settings let it.
    #[must_use]
    pub fn new(settings: &Settings, clock: Clock) -> Self {
        let guard = Arc::new(Guard::new(settings));
        Self(Arc::new(Inner { guard, clock, secure: OnceLock::new(), plain: OnceLock::new() }))
    }

    /// Checks everything about a URL that can be checked without asking what its host's name stands for.
    ///
    /// # Errors
    /// Why the service would not talk to it.
    pub fn check(&self, url: &str) -> Result<(), Blocked> {
        self.0.guard.check(url).map(|_| ())
    }

    /// Posts JSON and gives what was answered within that time, wherever that leads: a redirect is an answer, and is not followed.
    ///
    /// # Errors
    /// When there is no answer.
    pub async fn post_json(
        &self,
        url: &str,
        headers: &[(&'static str, String)],
        body: String,
        timeout: Duration,
    ) -> Result<Answer, SendError> {
        let url = self.checked(url)?;
        let request = self.client(&url)?.post(url).timeout(timeout).header(header::CONTENT_TYPE, "application/json");
        let request = headers.iter().fold(request, |request, (name, value)| request.header(*name, value));
        let answer = request.body(body).send().await.map_err(|error| send_error(&error))?;
        let retry_after = answer.headers().get(header::RETRY_AFTER).and_then(|value| value.to_str().ok());
        let retry_after = retry_after.and_then(|text| retry_after::parse(text, self.0.clock.now()));
        Ok(Answer { status: answer.status().as_u16(), retry_after })
    }

    /// The URL, when the service may go there as far as it can be told before its name is resolved.
    pub(super) fn checked(&self, url: &str) -> Result<Url, SendError> {
        Ok(self.0.guard.check(url)?)
    }

    pub(super) fn client(&self, url: &Url) -> Result<Client, SendError> {
        let (place, reach) = match url.scheme() {
            "https" => (&self.0.secure, Reach::Public),
            _ => (&self.0.plain, Reach::Allowed),
        };
        if let Some(client) = place.get() {
            return Ok(client.clone());
        }
        let resolver = GuardedResolver { guard: Arc::clone(&self.0.guard), reach };
        let builder = Client::builder().no_proxy().redirect(Policy::none()).dns_resolver(Arc::new(resolver));
        let client = builder.user_agent(concat!("retargetd/", env!("CARGO_PKG_VERSION"))).build().map_err(|error| {
            tracing::error!(error = %chain(&error), "the service cannot talk to others");
            SendError::Unreachable
        })?;
        Ok(place.get_or_init(|| client).clone())
    }
}

/// What callers are told of a failure; the rest goes to the log.
pub(super) fn send_error(error: &reqwest::Error) -> SendError {
    let mut source: Option<&(dyn Error + 'static)> = error.source();
    while let Some(error) = source {
        if let Some(blocked) = error.downcast_ref::<Blocked>() {
            return SendError::Blocked(*blocked);
        }
        source = error.source();
    }
    if error.is_timeout() {
        return SendError::TimedOut;
    }
    tracing::info!(error = %chain(error), "a place that a caller named cannot be reached");
    SendError::Unreachable
}

/// An error with what caused it, without the URL, which may hold what is secret.
fn chain(error: &reqwest::Error) -> String {
    let mut text = String::new();
    let mut source: Option<&(dyn Error + 'static)> = error.source();
    while let Some(error) = source {
        text = if text.is_empty() { error.to_string() } else { format!("{text}: {error}") };
        source = error.source();
    }
    text
}
