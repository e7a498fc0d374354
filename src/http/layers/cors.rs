//! Which web pages may call the service from a browser. None, unless the operator names their origins.

use std::time::Duration;

use axum::http::{HeaderName, HeaderValue, Method, header};
use tower_http::cors::{AllowOrigin, CorsLayer};

use crate::config::Origins;

const REQUEST_HEADERS: [&str; 14] = [
    "accept",
    "authorization",
    "content-digest",
    "content-type",
    "idempotency-key",
    "if-match",
    "if-none-match",
    "if-range",
    "last-event-id",
    "prefer",
    "range",
    "repr-digest",
    "traceparent",
    "x-request-id",
];
const ANSWER_HEADERS: [&str; 17] = [
    "accept-ranges",
    "content-disposition",
    "content-range",
    "coverage",
    "document-version",
    "etag",
    "idempotent-replayed",
    "job-id",
    "location",
    "preference-applied",
    "ratelimit",
    "ratelimit-policy",
    "retry-after",
    "server-timing",
    "verdict",
    "verdict-reason",
    "warnings-count",
];

/// Answers browsers that ask beforehand, and lets pages of these origins read the answers. Callers are told apart by a header of their
/// own, never by cookies, so no credentials are allowed.
pub(super) fn layer(origins: &Origins) -> CorsLayer {
    let origins = origins.0.iter().filter_map(|origin| HeaderValue::from_str(origin).ok());
    CorsLayer::new()
        .allow_origin(AllowOrigin::list(origins))
        .allow_methods([Method::GET, Method::HEAD, Method::POST, Method::PUT, Method::DELETE])
        .allow_headers(REQUEST_HEADERS.map(HeaderName::from_static))
        .expose_headers(
            ANSWER_HEADERS.map(HeaderName::from_static).into_iter().chain([header::CONTENT_LENGTH]).collect::<Vec<_>>(),
        )
        .max_age(Duration::from_secs(3600))
}
