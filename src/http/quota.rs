//! The headers that tell a caller what is left of a quota (`RateLimit-Policy` and `RateLimit`, IETF draft).

use axum::http::{HeaderName, HeaderValue};

use super::download::ascii;
use crate::jobs::JobQuota;

const POLICY: HeaderName = HeaderName::from_static("ratelimit-policy");
const LEFT: HeaderName = HeaderName::from_static("ratelimit");

/// How many unfinished jobs there may be, and how many more; nothing where there is no quota.
pub(super) fn headers(quota: Option<JobQuota>) -> impl Iterator<Item = (HeaderName, HeaderValue)> {
    quota.into_iter().flat_map(|JobQuota { most, unfinished }| {
        let left = most.saturating_sub(unfinished);
        [
            (POLICY, ascii(format!("\"jobs\";q={most};qu=\"unfinished-jobs\""))),
            (LEFT, ascii(format!("\"jobs\";r={left}"))),
        ]
    })
}
