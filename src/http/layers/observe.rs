//! One log line and one count per request. Routes are told by their template, so that labels stay few.

use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request},
    middleware::Next,
    response::Response,
};

use super::{
    RequestId,
    trace::{Came, TraceId, TracedRequest, standard_method},
};
use crate::{
    http::auth::Caller,
    telemetry::{Metric, TraceContext},
};

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

pub(super) async fn observe(mut request: Request, next: Next) -> Response {
    let began = Instant::now();
    let _in_flight = InFlight::begin();
    let route = request.extensions().get::<MatchedPath>().map_or("unmatched", MatchedPath::as_str).to_owned();
    let method = standard_method(request.method().as_str());
    let request_id = request.extensions().get::<RequestId>().map_or_else(String::new, |id| id.as_str().to_owned());
    request.extensions_mut().insert(Came(began));
    let response = next.run(request).await;
    let (status, took) = (response.status().as_u16(), began.elapsed());
    let job_id = response.headers().get("job-id").and_then(|id| id.to_str().ok()).unwrap_or_default();
    let principal = response.extensions().get::<Caller>().map_or("", |caller| caller.0.as_str());
    let trace_id = response.extensions().get::<TraceId>().cloned().unwrap_or_else(|| {
        // Refused before it was known who asks.
        let asked = TracedRequest { method, route: &route, came: began, request_id: &request_id };
        let span = asked.span(None);
        let trace_id = span.context().as_ref().map_or_else(String::new, TraceContext::trace_id);
        asked.answered(span, status);
        TraceId(trace_id)
    });
    tracing::info!(
        method,
        route,
        status,
        duration_seconds = took.as_secs_f64(),
        request_id,
        trace_id = trace_id.0,
        job_id,
        principal,
        "answered"
    );
    Metric::HttpRequestDuration.observe([("route", route.clone()), ("method", method.to_owned())], took);
    let labels = [("route", route), ("method", method.to_owned()), ("status", status.to_string())];
    Metric::HttpRequests.count(labels, 1);
    response
}
