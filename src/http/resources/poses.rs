//! `POST /v1/poses`: a character in, the same character in a pose out. A job with a wait, like every other work.

use axum::{
    body::Body,
    extract::{FromRequest, Request, State},
    response::Response,
};
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use super::new_job::{InputBody, read_inputs};
use crate::{
    http::{
        ApiState,
        auth::Caller,
        extract::{JsonBody, QueryOf, is_media_type},
        idempotency::IdempotencyKey,
        one_shot::OneShotHeaders,
        prefer::Prefer,
        problem::Problem,
        resources::retarget::answer,
        upload::{self, Parts},
        views::JobView,
    },
    jobs::{InputRole, JobTask, NewJob},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(pose))
}

/// The parts of a pose, in any order.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: parts are streamed, never held in one value")]
pub(in crate::http) struct PoseForm {
    /// The file with the character.
    #[schema(content_media_type = "application/octet-stream")]
    target: String,
    /// Another character, whose rest pose it takes.
    #[schema(content_media_type = "application/octet-stream")]
    source: Option<String>,
    /// The character in its rest pose, where its file does not hold it.
    #[schema(content_media_type = "application/octet-stream")]
    target_rest: Option<String>,
    /// The other character in its rest pose, where its file does not hold it.
    #[schema(content_media_type = "application/octet-stream")]
    source_rest: Option<String>,
}

/// A pose of an uploaded character.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewPose)]
pub(in crate::http) struct PoseBody {
    /// The file with the character.
    target: InputBody,
    /// Another character, whose rest pose it takes.
    source: Option<InputBody>,
    /// The character in its rest pose, where its file does not hold it.
    target_rest: Option<InputBody>,
    /// The other character in its rest pose, where its file does not hold it.
    source_rest: Option<InputBody>,
}

impl PoseBody {
    fn read(self) -> Result<NewJob, Problem> {
        let inputs = read_inputs([self.source, Some(self.target), self.source_rest, self.target_rest, None])?;
        Ok(NewJob { inputs, ..NewJob::default() })
    }
}

#[derive(Debug, Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
struct PoseQuery {
    /// The pose: `t`, `a`, `rest` or `source`. Default: `source` where that part was sent, else `t`.
    #[param(inline)]
    to: Option<PoseName>,
}

/// A pose by its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum PoseName {
    /// Arms horizontal.
    T,
    /// Arms 45° below the horizontal.
    A,
    /// Its own rest pose.
    Rest,
    /// The rest pose of the source.
    Source,
}

impl PoseName {
    const fn name(self) -> &'static str {
        match self {
            Self::T => "t",
            Self::A => "a",
            Self::Rest => "rest",
            Self::Source => "source",
        }
    }
}

/// Puts a character into a T pose, an A pose or another character's rest pose, and returns the file.
///
/// The format is that of `Accept`, else GLB. A glTF or VRM keeps everything but its animations: its nodes have the
/// pose, and one animation holds it. The same with edits, roles and axes of your own: `POST /v1/retarget` with `pose`
/// in the config.
#[utoipa::path(post, path = "/v1/poses", tag = "retarget",
    params(PoseQuery, ("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds"),
        ("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same job"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to compute it even if results are cached"),
        ("Accept" = Option<String>, Header, description = "media type of the requested format")),
    request_body(description = "the files, or the ids of uploaded ones", content(
        (PoseForm = "multipart/form-data"), (PoseBody = "application/json"))),
    responses((status = 200, description = "the file", content((String = "model/gltf-binary"), (String = "model/gltf+json"),
            (String = "text/plain"), (String = "application/x-npz"), (Object = "application/json")),
            headers(("Job-Id" = String), ("ETag" = String), ("Server-Timing" = String), ("Warnings-Count" = u64),
                ("Content-Disposition" = String))),
        (status = 202, body = JobView, description = "not finished within the wait", headers(("Location" = String), ("Retry-After" = u32)))))]
async fn pose(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    idempotency_key: IdempotencyKey,
    QueryOf(query): QueryOf<PoseQuery>,
    prefer: Prefer,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let headers = OneShotHeaders::read(&state, request.headers(), idempotency_key).await?;
    let Parts { files, mut new } = if is_media_type(request.headers(), "application/json") {
        Parts::of_assets(JsonBody::<PoseBody>::from_request(request, &state).await?.0.read()?)
    } else {
        upload::read_pose(request, &state).await?
    };
    let has_source = files.has(InputRole::Source) || new.inputs.contains_key(&InputRole::Source);
    let to = query.to.unwrap_or(if has_source { PoseName::Source } else { PoseName::T });
    if to == PoseName::Source && !has_source {
        return Err(upload::missing(InputRole::Source));
    }
    new.task = Some(JobTask::Pose { to: Some(to.name().to_owned()) });
    headers.apply(&mut new);
    answer(&state, &owner, &prefer, Parts { files, new }).await
}
