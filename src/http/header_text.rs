//! Headers as text.

use axum::http::{HeaderMap, HeaderName};

/// A header as text; empty when it is not there or no text.
pub(super) fn text<'a>(headers: &'a HeaderMap, name: &HeaderName) -> &'a str {
    headers.get(name).and_then(|value| value.to_str().ok()).unwrap_or_default()
}
