//! Whether results that are there already will do, and whether they did.

use axum::http::{HeaderMap, HeaderName, HeaderValue, header};

use super::extract;
use crate::jobs::JobRecord;

/// Whether the caller wants a job to be run whatever is there (`Cache-Control: no-cache`).
pub(super) fn is_skipped(headers: &HeaderMap) -> bool {
    let words = extract::text(headers, &header::CACHE_CONTROL).split(',').map(str::trim);
    words.into_iter().any(|word| word.eq_ignore_ascii_case("no-cache") || word.eq_ignore_ascii_case("no-store"))
}

/// `hit` where a job was given what another one had computed, `miss` where it computed itself what others may be given.
pub(super) fn word(record: &JobRecord) -> Option<&'static str> {
    match (&record.cached_from, &record.cache_key) {
        (Some(_), _) => Some("hit"),
        (None, Some(_)) => Some("miss"),
        (None, None) => None,
    }
}

/// The same as a header (`Cache-Status`, RFC 9211).
pub(super) fn status(record: &JobRecord) -> Option<(HeaderName, HeaderValue)> {
    let value = match word(record)? {
        "hit" => "retargetd; hit",
        _ => "retargetd; fwd=miss",
    };
    Some((HeaderName::from_static("cache-status"), HeaderValue::from_static(value)))
}
