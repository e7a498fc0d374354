//! `/v1/results`: the files that jobs gave.

use axum::{
    Json,
    extract::State,
    http::{HeaderMap, Method},
    response::Response,
};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{ApiState, auth::Caller, download::File, extract::Id, problem::Problem, views::ResultView},
    jobs::{Jobs, ResultId},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(show)).routes(routes!(content))
}

/// Shows a result.
#[utoipa::path(get, path = "/v1/results/{id}", operation_id = "show_result", tag = "results", params(("id" = String, Path, description = "the result")),
    responses((status = 200, body = ResultView, description = "the result")))]
async fn show(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<ResultId>,
) -> Result<Json<ResultView>, Problem> {
    Ok(Json(jobs.result(&owner, &id).await?.into()))
}

/// Downloads a result.
///
/// Immutable: `ETag` is its digest, and it may be cached until it expires.
#[utoipa::path(get, path = "/v1/results/{id}/content", operation_id = "download_result", tag = "results", params(("id" = String, Path, description = "the result"),
    ("Range" = Option<String>, Header, description = "one range of bytes"),
    ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "*/*", body = String, description = "the bytes, under the media type of the format"),
        (status = 206, content_type = "*/*", body = String, description = "a range of the bytes"),
        (status = 304, description = "not modified")))]
async fn content(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<ResultId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    File::from(jobs.result(&owner, &id).await?).answer(&method, &headers, &jobs).await
}
