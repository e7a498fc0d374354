//! `POST /v1/drawings`: a drawn character and a motion in, the moving drawing out. A job with a wait, like every other work.

use axum::{
    body::Body,
    extract::{Request, State},
    response::Response,
};
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{
        ApiState,
        auth::Caller,
        idempotency::IdempotencyKey,
        one_shot::OneShotHeaders,
        prefer::Prefer,
        problem::Problem,
        resources::retarget::answer,
        upload::{self, Parts},
        views::JobView,
    },
    jobs::JobTask,
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(draw))
}

/// The parts of a drawing that is to move, in any order.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: parts are streamed, never held in one value")]
pub(in crate::http) struct DrawingForm {
    /// The file with the motion, of any format that is read. Only with `mvc` it may be left out.
    #[schema(content_media_type = "application/octet-stream")]
    source: Option<String>,
    /// The drawing as a zip archive: `char_cfg.yaml`, `texture.png` and `mask.png`; of a scene everything that it names. Or a picture alone (PNG,
    /// JPEG, WebP), whose mask and joints are found. Or instead of it the three parts `character`, `texture` and `mask`.
    #[schema(content_media_type = "application/octet-stream")]
    drawing: Option<String>,
    /// The character config: width, height and the joints.
    #[schema(content_media_type = "application/yaml")]
    character: Option<String>,
    /// The texture: PNG, JPEG or WebP.
    #[schema(content_media_type = "image/png")]
    texture: Option<String>,
    /// The mask: white where the figure is.
    #[schema(content_media_type = "image/png")]
    mask: Option<String>,
    /// A motion config of *Animated Drawings*, which says how a BVH source is read.
    #[schema(content_media_type = "application/yaml")]
    motion: Option<String>,
    /// A retarget config of *Animated Drawings*.
    #[schema(content_media_type = "application/yaml")]
    retarget: Option<String>,
    /// A scene (MVC) config of *Animated Drawings*. What it names is looked for in the archive by the ends of the paths.
    #[schema(content_media_type = "application/yaml")]
    mvc: Option<String>,
    /// A picture behind everything.
    #[schema(content_media_type = "image/png")]
    background: Option<String>,
    /// The draw spec (JSON or YAML); `/v1/schemas/draw-spec` is its schema.
    #[schema(content_media_type = "application/json")]
    config: Option<String>,
    /// The name of a preset that the config is laid over.
    preset: Option<String>,
}

/// Has a drawing move and gives the moving drawing back.
///
/// The format is that of `Accept`, else of the config's `output`, else GIF: `image/gif`, `image/webp`, `image/apng`, `video/mp4`,
/// `application/zip` (frames as PNG), `model/gltf-binary` (a textured model on bones), `application/x-npz` and `application/json` (poses).
/// The same as a job of `POST /v1/jobs` whose target is a drawing. When it takes longer than the wait, the answer is 202 with the job,
/// which goes on.
#[utoipa::path(post, path = "/v1/drawings", tag = "retarget",
    params(("Prefer" = Option<String>, Header, description = "`wait=N` to wait up to N seconds"),
        ("Idempotency-Key" = Option<String>, Header, description = "a unique key of this request, chosen by the client: a repeated request with the same key returns the same job"),
        ("Cache-Control" = Option<String>, Header, description = "`no-cache` to have it computed although the results are there"),
        ("Accept" = Option<String>, Header, description = "the media type of the format wanted")),
    request_body(content = DrawingForm, content_type = "multipart/form-data"),
    responses((status = 200, description = "the file", content((String = "image/gif"), (String = "image/webp"), (String = "image/apng"),
            (String = "video/mp4"), (String = "application/zip"), (String = "model/gltf-binary"), (String = "application/x-npz"),
            (Object = "application/json")),
            headers(("Job-Id" = String), ("ETag" = String), ("Server-Timing" = String), ("Warnings-Count" = u64),
                ("Content-Disposition" = String))),
        (status = 202, body = JobView, description = "not ended within the wait", headers(("Location" = String), ("Retry-After" = u32)))))]
async fn draw(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    idempotency_key: IdempotencyKey,
    prefer: Prefer,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let headers = OneShotHeaders::read(&state, request.headers(), idempotency_key).await?;
    let Parts { files, mut new } = upload::read_drawing(request, &state).await?;
    new.task = Some(JobTask::Draw);
    headers.apply(&mut new);
    answer(&state, &owner, &prefer, Parts { files, new }).await
}
