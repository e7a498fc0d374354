//! What machines ask: alive, ready, metrics.

use axum::{
    Json, Router,
    extract::{FromRef, State},
    http::header,
    response::{IntoResponse, Response},
    routing::get,
};
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{
        code::Code,
        problem::{Problem, ProblemView},
    },
    identity::Tokens,
    jobs::{Jobs, Refusal},
    telemetry::Metrics,
};

/// The routes, beside any others: they ask for nothing but the jobs, the tokens and the metrics.
pub(in crate::http) fn routes<S>() -> OpenApiRouter<S>
where
    S: Clone + Send + Sync + 'static,
    Jobs: FromRef<S>,
    Tokens: FromRef<S>,
    Metrics: FromRef<S>,
{
    OpenApiRouter::new().routes(routes!(live)).routes(routes!(ready)).routes(routes!(metrics))
}

/// The two that say how the service is, without the metrics.
pub(in crate::http) fn health_routes<S>() -> Router<S>
where
    S: Clone + Send + Sync + 'static,
    Jobs: FromRef<S>,
    Tokens: FromRef<S>,
{
    Router::new().route("/livez", get(live)).route("/readyz", get(ready))
}

/// An answer to a probe.
#[derive(Debug, Serialize, ToSchema)]
struct Status {
    /// `ok`.
    status: &'static str,
}

/// Checks that the process responds.
///
/// Independent of load: a busy service is alive.
#[utoipa::path(get, path = "/livez", tag = "service", responses((status = 200, body = Status, description = "alive")))]
async fn live() -> Json<Status> {
    Json(Status { status: "ok" })
}

/// Checks whether the service accepts work.
///
/// Not ready while shutting down, if the store does not answer or its disk has only its reserve left, or, if tokens
/// are accepted, until they can be verified. A full queue does not count: it is reported to requests that submit
/// work.
#[utoipa::path(get, path = "/readyz", tag = "service",
    responses((status = 200, body = Status, description = "ready"),
        (status = 503, body = ProblemView, content_type = "application/problem+json", description = "not ready")))]
async fn ready(State(jobs): State<Jobs>, State(tokens): State<Tokens>) -> Result<Json<Status>, Problem> {
    if jobs.is_draining() {
        return Err(Refusal::Draining.into());
    }
    jobs.check_store().await.map_err(|error| {
        tracing::error!(%error, "the store cannot be used");
        match error {
            Refusal::StorageFull(_) => Problem::new(Code::Unavailable, "the disk has no more than its reserve left"),
            _ => Problem::new(Code::Unavailable, "the store does not answer"),
        }
    })?;
    if !tokens.can_be_checked() {
        return Err(Problem::new(Code::Unavailable, "the keys of the token issuer have not been fetched yet"));
    }
    Ok(Json(Status { status: "ok" }))
}

/// Returns metrics in the Prometheus format.
#[utoipa::path(get, path = "/metrics", tag = "service",
    responses((status = 200, body = String, content_type = "text/plain", description = "the metrics")))]
async fn metrics(State(jobs): State<Jobs>, State(metrics): State<Metrics>) -> Response {
    jobs.observe_queue().await;
    ([(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], metrics.render()).into_response()
}
