//! How long a request is willing to wait (`Prefer`, RFC 7240).

use std::{convert::Infallible, time::Duration};

use axum::{
    extract::FromRequestParts,
    http::{HeaderMap, HeaderName, HeaderValue, request::Parts},
};

/// What a request prefers. What is not understood is ignored, as the RFC says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Prefer {
    wait: Option<Duration>,
}

impl Prefer {
    fn read(headers: &HeaderMap) -> Self {
        let values = headers.get_all("prefer").into_iter().filter_map(|value| value.to_str().ok());
        let mut found = Self::default();
        for preference in values.flat_map(|value| value.split(',')).map(str::trim) {
            let seconds = match preference.split_once('=') {
                Some((name, seconds)) if name.trim().eq_ignore_ascii_case("wait") => seconds.trim().parse().ok(),
                None if preference.eq_ignore_ascii_case("respond-async") => Some(0),
                _ => None,
            };
            // The first of several stands.
            found.wait = found.wait.or(seconds.map(Duration::from_secs));
        }
        found
    }

    /// How long to wait: what was asked for, else `default`; never more than `longest`.
    pub(super) fn wait(self, default: Duration, longest: Duration) -> Duration {
        self.wait.unwrap_or(default).min(longest)
    }

    /// The header that says that the preference was heard.
    pub(super) fn applied(self, longest: Duration) -> Option<(HeaderName, HeaderValue)> {
        let seconds = self.wait?.min(longest).as_secs();
        let value = HeaderValue::from_str(&format!("wait={seconds}")).ok()?;
        Some((HeaderName::from_static("preference-applied"), value))
    }
}

impl<S: Send + Sync> FromRequestParts<S> for Prefer {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _state: &S) -> Result<Self, Infallible> {
        Ok(Self::read(&parts.headers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wait_of(value: &'static str) -> u64 {
        let headers = HeaderMap::from_iter([(HeaderName::from_static("prefer"), HeaderValue::from_static(value))]);
        Prefer::read(&headers).wait(Duration::from_secs(7), Duration::from_secs(30)).as_secs()
    }

    #[test]
    fn what_is_asked_for_is_capped_and_nonsense_is_ignored() {
        assert_eq!(wait_of("wait=10"), 10, "as asked");
        assert_eq!(wait_of("handling=lenient, WAIT=5"), 5, "among others, letters of either case");
        assert_eq!(wait_of("wait=9999"), 30, "capped");
        assert_eq!(wait_of("respond-async"), 0, "does not wait");
        assert_eq!(wait_of("wait=soon"), 7, "ignored");
    }
}
