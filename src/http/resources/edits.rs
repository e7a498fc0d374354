//! `POST /v1/edits`: a clip in, the same clip edited out, without a second rig. A job with a wait, like every other work.

use axum::{
    body::Body,
    extract::{FromRequest, Request, State},
    response::Response,
};
use serde::Deserialize;
use serde_json::{Map, Value};
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use super::new_job::{InputBody, config_document, read_inputs};
use crate::{
    http::{
        ApiState,
        auth::Caller,
        extract::{JsonBody, is_media_type},
        idempotency::IdempotencyKey,
        one_shot::OneShotHeaders,
        prefer::Prefer,
        problem::Problem,
        resources::retarget::answer,
        upload::{self, Parts},
        views::JobView,
    },
    jobs::{JobTask, NewJob},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(edit))
}

/// The parts of an edit, in any order.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: parts are streamed, never held in one value")]
pub(in crate::http) struct EditForm {
    /// The file with the animation.
    #[schema(content_media_type = "application/octet-stream")]
    source: String,
    /// The rig in its rest pose, where the file does not hold it.
    #[schema(content_media_type = "application/octet-stream")]
    source_rest: Option<String>,
    /// The retarget spec (JSON or YAML), whose `edit` says what is to be done.
    #[schema(content_media_type = "application/json")]
    config: Option<String>,
    /// The name of a preset that the config is laid over.
    preset: Option<String>,
}

/// An edit of an uploaded file.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewEdit)]
pub(in crate::http) struct EditBody {
    /// The file with the animation.
    source: InputBody,
    /// The rig in its rest pose, where the file does not hold it.
    source_rest: Option<InputBody>,
    /// The retarget spec, whose `edit` says what is to be done.
    #[schema(value_type = Option<Object>)]
    config: Option<Map<String, Value>>,
    /// A preset that the config is laid over.
    preset: Option<String>,
}

impl EditBody {
    fn read(self) -> Result<NewJob, Problem> {
        let inputs = read_inputs([Some(self.source), None, self.source_rest, None, None])?;
        Ok(NewJob { inputs, config: self.config.map(config_document), preset: self.preset, ..NewJob::default() })
    }
}

/// Edits the clip of a file (timing, loop seams, mirroring) and returns the file.
///
/// The format is that of `Accept`, else of the config's `output.format`, else GLB. A glTF or VRM keeps everything
/// else; the edited clip is its first animation. The same as a job of `POST /v1/jobs`: `"task": "edit"` in the
/// config.
#[utoipa::path(post, path = "/v1/edits", tag = "retarget",
    params(("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds"),
        ("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same job"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to compute it even if results are cached"),
        ("Accept" = Option<String>, Header, description = "media type of the requested format")),
    request_body(description = "the file, or the id of an uploaded one", content(
        (EditForm = "multipart/form-data"), (EditBody = "application/json"))),
    responses((status = 200, description = "the file", content((String = "model/gltf-binary"), (String = "model/gltf+json"),
            (String = "text/plain"), (String = "application/x-npz"), (Object = "application/json")),
            headers(("Job-Id" = String), ("ETag" = String), ("Server-Timing" = String), ("Warnings-Count" = u64),
                ("Content-Disposition" = String))),
        (status = 202, body = JobView, description = "not finished within the wait", headers(("Location" = String), ("Retry-After" = u32)))))]
async fn edit(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    idempotency_key: IdempotencyKey,
    prefer: Prefer,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let headers = OneShotHeaders::read(&state, request.headers(), idempotency_key).await?;
    let Parts { files, mut new } = if is_media_type(request.headers(), "application/json") {
        Parts::of_assets(JsonBody::<EditBody>::from_request(request, &state).await?.0.read()?)
    } else {
        upload::read_edit(request, &state).await?
    };
    new.task = Some(JobTask::Edit);
    headers.apply(&mut new);
    answer(&state, &owner, &prefer, Parts { files, new }).await
}
