//! One span per request. Whose trace it belongs to is for callers to say, but only for those of whom it is known who they are.

use std::time::Instant;

use axum::{
    extract::{MatchedPath, Request, State},
    http::HeaderName,
    middleware::Next,
    response::Response,
};

use super::RequestId;
use crate::{
    http::{ApiState, auth::Caller, extract},
    jobs::Principal,
    telemetry::{Span, TraceContext},
};

const TRACE_PARENT: HeaderName = HeaderName::from_static("traceparent");
const TRACE_STATE: HeaderName = HeaderName::from_static("tracestate");

/// When a request came.
#[derive(Clone, Copy)]
pub(super) struct Came(pub(super) Instant);

/// The id of the trace of an answer; empty where there is none.
#[derive(Clone)]
pub(super) struct TraceId(pub(super) String);

/// A request, as its span tells it.
pub(super) struct TracedRequest<'a> {
    pub(super) method: &'static str,
    pub(super) route: &'a str,
    pub(super) came: Instant,
    pub(super) request_id: &'a str,
}

impl TracedRequest<'_> {
    /// Probes come every few seconds, and tell nobody anything.
    pub(super) fn span(&self, parent: Option<&TraceContext>) -> Span {
        let is_traced = self.route.starts_with("/v1/");
        if is_traced { Span::of_request(self.method, self.route, parent, self.came) } else { Span::default() }
    }

    /// Ends it.
    pub(super) fn answered(&self, mut span: Span, status: u16) {
        span.note("http.response.status_code", || i64::from(status));
        span.note("retargetd.request_id", || self.request_id.to_owned());
        if status >= 500 {
            span.fail(&status.to_string());
        }
    }
}

/// Covers what is done for a caller who was let in.
pub(super) async fn trace(State(state): State<ApiState>, request: Request, next: Next) -> Response {
    let extensions = request.extensions();
    let route = extensions.get::<MatchedPath>().map_or("unmatched", MatchedPath::as_str).to_owned();
    let request_id = extensions.get::<RequestId>().map_or_else(String::new, |id| id.as_str().to_owned());
    let came = extensions.get::<Came>().map_or_else(Instant::now, |came| came.0);
    let is_known = extensions.get::<Caller>().is_some_and(|caller| caller.0 != Principal::anonymous());
    let method = standard_method(request.method().as_str());
    let asked = TracedRequest { method, route: &route, came, request_id: &request_id };
    let asked_by = TraceContext::from_headers(
        extract::text(request.headers(), &TRACE_PARENT),
        extract::text(request.headers(), &TRACE_STATE),
    );
    // Where callers show who they are, one who does not decides nothing of what is recorded.
    let asked_by = asked_by.filter(|_| is_known || !state.settings.asks_who_calls());
    let span = asked.span(asked_by.as_ref());
    let context = span.context().or(asked_by);
    let trace_id = context.as_ref().map_or_else(String::new, TraceContext::trace_id);
    let mut response = TraceContext::cover(context, next.run(request)).await;
    asked.answered(span, response.status().as_u16());
    response.extensions_mut().insert(TraceId(trace_id));
    response
}

/// Anybody can send any word as a method; labels are of a closed set.
pub(super) fn standard_method(method: &str) -> &'static str {
    const KNOWN: [&str; 7] = ["GET", "POST", "DELETE", "HEAD", "PUT", "PATCH", "OPTIONS"];
    KNOWN.into_iter().find(|known| *known == method).unwrap_or("other")
}
