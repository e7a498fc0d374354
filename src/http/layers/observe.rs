//! One log line and one count per request. Routes are told by their template, so that labels stay few.

use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request},
    middleware::Next,
    response::Response,
};

use super::RequestId;
use crate::{http::auth::Caller, telemetry::Metric};

/// Counts a request as in flight until it is dropped, even when the caller goes away.
struct InFlight;

impl InFlight {
    fn begin() -> Self {
        Metric::HttpRequestsInFlight.change(1.0);
        Self
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        Metric::HttpRequestsInFlight.change(-1.0);
    }
}

pub(super) async fn observe(request: Request, next: Next) -> Response {
    let began = Instant::now();
    let _in_flight = InFlight::begin();
    let route = request.extensions().get::<MatchedPath>().map_or("unmatched", MatchedPath::as_str).to_owned();
    let method = standard_method(request.method().as_str());
    let request_id = request.extensions().get::<RequestId>().map_or_else(String::new, |id| id.as_str().to_owned());
    let response = next.run(request).await;
    let (status, took) = (response.status().as_u16(), began.elapsed());
    let job_id = response.headers().get("job-id").and_then(|id| id.to_str().ok()).unwrap_or_default();
    let principal = response.extensions().get::<Caller>().map_or("", |caller| caller.0.as_str());
    tracing::info!(
        method,
        route,
        status,
        duration_seconds = took.as_secs_f64(),
        request_id,
        job_id,
        principal,
        "answered"
    );
    Metric::HttpRequestDuration.observe([("route", route.clone()), ("method", method.to_owned())], took);
    let labels = [("route", route), ("method", method.to_owned()), ("status", status.to_string())];
    Metric::HttpRequests.count(labels, 1);
    response
}

/// Anybody can send any word as a method; labels are of a closed set.
fn standard_method(method: &str) -> &'static str {
    const KNOWN: [&str; 7] = ["GET", "POST", "DELETE", "HEAD", "PUT", "PATCH", "OPTIONS"];
    KNOWN.into_iter().find(|known| *known == method).unwrap_or("other")
}
