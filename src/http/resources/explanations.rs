//! `/v1/explanations`: why a joint of a result is turned as it is.

use axum::{
    Json,
    body::Body,
    extract::{Request, State},
};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::{new_job::SuggestionBody, proposals::read_files, retarget::RetargetForm};
use crate::http::{ApiState, auth::Caller, extract::QueryOf, problem::Problem};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(explain))
}

/// What is asked.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct Question {
    /// Frame of the result, from 0.
    #[param(example = 0)]
    frame: usize,
    /// Joint of the target, by name or `#<node index>`.
    #[param(example = "lowerarm_l")]
    joint: String,
}

/// Explains a joint at a frame.
///
/// The answer has the joints that it follows (`sources` with weights) and its `contributions` from the target's rest
/// pose to the result: rotations in model space, each applied to the product of the previous ones, so that the
/// product of all is the joint's rotation in a retarget of the same files and config. Either JSON that names uploaded
/// files, or the same multipart form as `POST /v1/retarget`.
#[utoipa::path(post, path = "/v1/explanations", tag = "retarget", params(Question),
    request_body(description = "two files", content(
        (SuggestionBody = "application/json"), (RetargetForm = "multipart/form-data"))),
    responses((status = 200, body = Object, description = "the explanation")))]
async fn explain(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    QueryOf(Question { frame, joint }): QueryOf<Question>,
    request: Request<Body>,
) -> Result<Json<serde_json::Value>, Problem> {
    let new = read_files(request, &state, &owner).await?;
    Ok(Json(state.assets.explain(&owner, new, frame, joint).await?))
}
