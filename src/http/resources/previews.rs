//! What assets and results look like.

use axum::{
    extract::{Path, State},
    http::{HeaderMap, HeaderValue, header},
    response::Response,
};
use serde::Deserialize;
use utoipa::IntoParams;
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    engine::{Background, CameraKind, Follow, Layout, PictureFormat, PreviewOptions, Sheet, SheetSize, Style, View},
    http::{
        ApiState,
        auth::Caller,
        code::Code,
        extract::{PathId as _, QueryOf, unusable},
        problem::Problem,
        unchanging::unchanging,
    },
    jobs::{AssetId, Assets, BatchId, Jobs, Pictured, ResultId},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new().routes(routes!(of_asset)).routes(routes!(of_result)).routes(routes!(of_batch))
}

/// How a file is seen. Everything has a default.
#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct PreviewQuery {
    /// Width and height in pixels, such as `512` or `640x360`, 16 to 1920; for a sheet, of each cell. Default 512.
    #[param(example = "256")]
    size: Option<String>,
    /// `front`, `three_quarter` (default), `side`, `back`, `top`, or `orbit`, which circles the figure once.
    #[param(value_type = Option<String>)]
    camera: Option<CameraKind>,
    /// `auto` (default), `figure`, or `hold`, which frames the whole path.
    #[param(value_type = Option<String>)]
    follow: Option<Follow>,
    /// Degrees by which the camera orbits the figure from the first frame to the last.
    turn: Option<f64>,
    /// Frames per second of a moving picture, 1 to 60. Default 15 for GIF, 30 otherwise.
    fps: Option<f64>,
    /// Start of the shown part of the clip, in seconds.
    start: Option<f64>,
    /// Its end, in seconds.
    end: Option<f64>,
    /// Time of a still in seconds. Default: the middle of the clip.
    at: Option<f64>,
    /// A sheet of stills over the whole clip, such as `4x3`.
    sheet: Option<String>,
    /// `light` (default), `dark` or `transparent`.
    #[param(value_type = Option<String>)]
    background: Option<Background>,
    /// `shaded` (default), `skeleton`, `both`, `depth` or `silhouette`.
    #[param(value_type = Option<String>)]
    style: Option<Style>,
    /// The clip to show. Default: the first that moves.
    clip: Option<String>,
    /// Whether the time is drawn on the picture.
    #[serde(default)]
    labels: bool,
    /// Whether the floor is drawn. Default true.
    floor: Option<bool>,
}

/// Renders a file.
///
/// Shows the mesh or, without one, capsules along the bones; in its clip or, without one, at rest. `png` is a still;
/// `gif`, `apng` and `mp4` move (`mp4` where the service was built with that feature); `webp` moves where the file
/// does and neither `at` nor `sheet` is given. The picture of a file never changes: it may be cached for as long as
/// the file is kept.
#[utoipa::path(get, path = "/v1/assets/{id}/preview.{ending}", operation_id = "preview_asset", tag = "assets",
    params(("id" = String, Path, description = "the asset"), ("ending" = String, Path, description = "`png`, `webp`, `gif`, `apng` or `mp4`", example = "png"), PreviewQuery,
        ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "image/*", body = String, description = "the picture"),
        (status = 304, description = "not modified")))]
async fn of_asset(
    State(assets): State<Assets>,
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Path((id, ending)): Path<(String, String)>,
    QueryOf(query): QueryOf<PreviewQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = AssetId::read(&id).ok_or_else(|| AssetId::not_one(&id))?;
    let options = query.options(&ending)?;
    answer(&jobs, assets.get(&owner, &id).await?.into(), options, &headers).await
}

/// Renders a result.
///
/// As `GET /v1/assets/{id}/preview.{ending}`.
#[utoipa::path(get, path = "/v1/results/{id}/preview.{ending}", operation_id = "preview_result", tag = "results",
    params(("id" = String, Path, description = "the result"), ("ending" = String, Path, description = "`png`, `webp`, `gif`, `apng` or `mp4`", example = "png"), PreviewQuery,
        ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "image/*", body = String, description = "the picture"),
        (status = 304, description = "not modified")))]
async fn of_result(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Path((id, ending)): Path<(String, String)>,
    QueryOf(query): QueryOf<PreviewQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = ResultId::read(&id).ok_or_else(|| ResultId::not_one(&id))?;
    let options = query.options(&ending)?;
    let result = jobs.result(&owner, &id).await?;
    answer(&jobs, Pictured::of_result(owner, result), options, &headers).await
}

/// Renders the first result of a batch.
///
/// The first result of its items that can be drawn, as `GET /v1/results/{id}/preview.{ending}` does. The first result
/// may change while items finish, so it is cached only briefly.
#[utoipa::path(get, path = "/v1/batches/{id}/preview.{ending}", operation_id = "preview_batch", tag = "batches",
    params(("id" = String, Path, description = "the batch"), ("ending" = String, Path, description = "`png`, `webp`, `gif`, `apng` or `mp4`", example = "png"), PreviewQuery,
        ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, content_type = "image/*", body = String, description = "the picture"),
        (status = 304, description = "not modified")))]
async fn of_batch(
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Path((id, ending)): Path<(String, String)>,
    QueryOf(query): QueryOf<PreviewQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let id = BatchId::read(&id).ok_or_else(|| BatchId::not_one(&id))?;
    let options = query.options(&ending)?;
    let mut response = answer(&jobs, jobs.batch_pictured(&owner, &id).await?, options, &headers).await?;
    response.headers_mut().insert(header::CACHE_CONTROL, HeaderValue::from_static("private, no-cache"));
    Ok(response)
}

async fn answer(
    jobs: &Jobs,
    file: Pictured,
    options: PreviewOptions,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let key = file.key(&options);
    let media_type = PictureFormat::of_ending(&options.ending, true).map_or("image/png", PictureFormat::media_type);
    unchanging(headers, &key, media_type, jobs.preview(&file, options)).await
}

impl PreviewQuery {
    fn options(self, ending: &str) -> Result<PreviewOptions, Problem> {
        if PictureFormat::of_ending(ending, true).is_none() {
            let shown: String = ending.chars().take(16).collect();
            return Err(Problem::new(Code::NotFound, format!("'{shown}' is the ending of no picture"))
                .with_hint("use png, webp, gif, apng or mp4"));
        }
        let usual = View::default();
        let size = match &self.size {
            Some(text) => size(text).ok_or_else(|| unusable("size", text, "pixels, as 512 or 640x360", "512"))?,
            None => usual.size,
        };
        let sheet = match &self.sheet {
            Some(text) => Some(pair(text).ok_or_else(|| unusable("sheet", text, "columns and rows, as 4x3", "4x3"))?),
            None => None,
        };
        let range = (self.start.is_some() || self.end.is_some())
            .then(|| [self.start.unwrap_or(0.0), self.end.unwrap_or(f64::MAX)]);
        let view = View {
            size,
            camera: self.camera.unwrap_or(usual.camera),
            follow: self.follow.unwrap_or(usual.follow),
            turn_degrees: self.turn.unwrap_or_default(),
            fps: self.fps,
            range,
            at_seconds: self.at,
            background: self.background.unwrap_or(usual.background),
            style: self.style.unwrap_or(usual.style),
            sheet: sheet.map(|[columns, rows]| Sheet::Even(SheetSize { columns, rows })),
            layout: Layout::Single,
            marks: false,
            labels: self.labels,
            floor: self.floor.unwrap_or(true),
        };
        if let Some((field, problem)) = view.problem() {
            return Err(Problem::new(Code::MalformedRequest, format!("the query cannot be used: {field}: {problem}")));
        }
        Ok(PreviewOptions { view, ending: ending.to_ascii_lowercase(), clip: self.clip })
    }
}

/// Two whole numbers with an `x` between them.
fn pair(text: &str) -> Option<[usize; 2]> {
    let (one, other) = text.split_once('x')?;
    Some([one.parse().ok()?, other.parse().ok()?])
}

fn size(text: &str) -> Option<[usize; 2]> {
    text.parse().ok().map(|side| [side, side]).or_else(|| pair(text))
}
