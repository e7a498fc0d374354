//! One log line, one count and one span per request. Routes are told by their template, so that labels stay few.

use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request, State},
    http::{HeaderName, header},
    middleware::Next,
    response::Response,
};

use super::RequestId;
use crate::{
    http::{ApiState, auth::Caller, extract},
    telemetry::{Metric, Span, TraceContext},
};

const TRACE_PARENT: HeaderName = HeaderName::from_static("traceparent");
const TRACE_STATE: HeaderName = HeaderName::from_static("tracestate");

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

pub(super) async fn observe(State(state): State<ApiState>, request: Request, next: Next) -> Response {
    let began = Instant::now();
    let _in_flight = InFlight::begin();
    let route = request.extensions().get::<MatchedPath>().map_or("unmatched", MatchedPath::as_str).to_owned();
    let method = standard_method(request.method().as_str());
    let request_id = request.extensions().get::<RequestId>().map_or_else(String::new, |id| id.as_str().to_owned());
    // Where callers show who they are, one who does not decides nothing of what is recorded.
    let is_trusted = !state.settings.asks_who_calls() || request.headers().contains_key(header::AUTHORIZATION);
    let asked_by = TraceContext::from_headers(
        extract::text(request.headers(), &TRACE_PARENT),
        extract::text(request.headers(), &TRACE_STATE),
    );
    let asked_by = asked_by.filter(|_| is_trusted);
    // Probes come every few seconds, and tell nobody anything.
    let is_traced = route.starts_with("/v1/");
    let mut span = if is_traced { Span::of_request(method, &route, asked_by.as_ref()) } else { Span::default() };
    let context = span.context().or(asked_by);
    let trace_id = context.as_ref().map_or_else(String::new, TraceContext::trace_id);
    let response = TraceContext::cover(context, next.run(request)).await;
    let (status, took) = (response.status().as_u16(), began.elapsed());
    let job_id = response.headers().get("job-id").and_then(|id| id.to_str().ok()).unwrap_or_default();
    let principal = response.extensions().get::<Caller>().map_or("", |caller| caller.0.as_str());
    span.note("http.response.status_code", || i64::from(status));
    span.note("retargetd.request_id", || request_id.clone());
    if status >= 500 {
        span.fail(&status.to_string());
    }
    tracing::info!(
        method,
        route,
        status,
        duration_seconds = took.as_secs_f64(),
        request_id,
        trace_id,
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
