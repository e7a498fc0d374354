//! `POST /v1/drawing-annotations`: a picture of a figure in, its mask and joints out.

use axum::{
    Json,
    body::Body,
    extract::{Request, State},
    http::{HeaderValue, header},
    response::{IntoResponse, Response},
};
use serde::Serialize;
use utoipa::ToSchema;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::http::{
    ApiState, auth::Caller, download::disposition, extract, negotiate, picture_form::read_drawing, problem::Problem,
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(annotate))
}

/// The parts of a drawing, in any order.
#[derive(ToSchema)]
#[allow(dead_code, reason = "only its schema is used: parts are read by hand")]
struct DrawingAnnotationForm {
    /// The picture: PNG, JPEG or WebP, of one figure on paper or on nothing.
    #[schema(content_media_type = "application/octet-stream")]
    image: String,
    /// Which pixels are the figure's: a picture of the same size, white or opaque where it is. It wins over what is found.
    #[schema(content_media_type = "application/octet-stream")]
    mask: Option<String>,
    /// What kind of body it is: `auto` (default), `humanoid`, `quadruped` or `chains`.
    rig: Option<String>,
}

/// What was found in a picture.
#[derive(Serialize, ToSchema)]
#[schema(as = DrawingAnnotation)]
#[allow(dead_code, reason = "only its schema is used: the engine writes the document")]
struct DrawingAnnotationView {
    /// The kind of body: `humanoid`, `quadruped` or `chains`.
    rig: String,
    /// How sure the joints are together, from 0 to 1.
    confidence: f64,
    /// Width and height of the texture and the mask in pixels.
    size: [u32; 2],
    /// The joints, the root first and each after its parent.
    skeleton: Vec<DrawnJoint>,
    /// The texture in the picture: `left`, `top`, `right` and `bottom`, in pixels of the picture as it was given.
    #[serde(rename = "box")]
    #[schema(value_type = Object)]
    bounds: serde_json::Value,
    /// Pixels of the texture for each of the picture.
    scale: f64,
    /// `origin` (`given`, `alpha` or `strokes`) and `pixels` of the mask.
    #[schema(value_type = Object)]
    mask: serde_json::Value,
    /// How many joints a pose model found. Absent where none did.
    joints_by_model: Option<u64>,
    /// Tips that stand out of the figure: hands, feet, head, hair and the like.
    tips: u64,
    /// Deviations and guesses: `code`, `place`, `detail`, `hint`.
    #[schema(value_type = Vec<Object>)]
    warnings: Vec<serde_json::Value>,
}

/// A joint of a drawing.
#[derive(Serialize, ToSchema)]
#[allow(dead_code, reason = "only its schema is used: the engine writes the document")]
struct DrawnJoint {
    /// Its name.
    name: String,
    /// The joint that it hangs on; the root has none.
    parent: Option<String>,
    /// In pixels of the texture from its left and its top.
    loc: [u32; 2],
    /// How sure its place is, from 0 to 1.
    confidence: f64,
}

/// Finds mask and joints of the figure in a picture, without a model unless whoever runs the service gave one.
///
/// The answer is a zip archive with `char_cfg.yaml`, `texture.png`, `mask.png`, `joint_overlay.png` and `bounding_box.yaml`, or with
/// `Accept: application/json` what was found: joints with confidence, box and warnings. Nothing is kept.
#[utoipa::path(post, path = "/v1/drawing-annotations", operation_id = "annotate_drawing", tag = "drawings",
    params(("Accept" = Option<String>, Header, description = "`application/zip` (default) or `application/json`")),
    request_body(content = DrawingAnnotationForm, content_type = "multipart/form-data"),
    responses((status = 200, description = "what was found", content((String = "application/zip"), (DrawingAnnotationView = "application/json")),
            headers(("Content-Disposition" = String)))))]
async fn annotate(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let wants_archive = negotiate::prefers_archive(extract::text(request.headers(), &header::ACCEPT))?;
    let new = read_drawing(request, &state).await?;
    if !wants_archive {
        return Ok(Json(state.jobs.annotate(&owner, new).await?).into_response());
    }
    let archive = state.jobs.annotated_archive(&owner, new).await?;
    let media_type = HeaderValue::from_static("application/zip");
    let headers = [(header::CONTENT_TYPE, media_type), (header::CONTENT_DISPOSITION, disposition("character.zip"))];
    Ok((headers, Body::from(archive)).into_response())
}
