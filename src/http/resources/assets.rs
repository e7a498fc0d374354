//! `/v1/assets`: uploaded files.

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Request, State},
    http::{HeaderMap, Method, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    config::Settings,
    engine::FindingCode,
    http::{
        ApiState, Shared,
        auth::Caller,
        code::Code,
        download::{File, ascii},
        extract::{Id, JsonBody, QueryOf, is_media_type},
        page::{self, PageQuery},
        problem::Problem,
        upload::{BodyReader, clean_name},
        views::{AssetPageView, AssetView},
    },
    jobs::{AssetId, AssetRecord, Assets, Jobs, NewFetch},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(create, list))
        .routes(routes!(fetch))
        .routes(routes!(show, delete))
        .routes(routes!(content))
        .routes(routes!(skeleton))
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct CreateQuery {
    /// Name of the file; its extension distinguishes `.vrm` from `.glb`.
    #[serde(default)]
    filename: String,
}

/// A file that the service is to fetch.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewAssetByUrl)]
struct NewAssetByUrl {
    /// Where it is: `https`, without user and password, and at an address that is public or in a network that the operator names.
    #[schema(example = "https://studio.example/clips/walk.bvh")]
    url: String,
    /// The SHA-256 of its bytes, in hexadecimal, as `sha256` of an asset; checked.
    digest: Option<String>,
}

impl NewAssetByUrl {
    fn read(self, file_name: String) -> Result<NewFetch, Problem> {
        let is_digest = |text: &String| text.len() == 64 && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        if self.digest.as_ref().is_some_and(|text| !is_digest(text)) {
            let detail = "a digest is a SHA-256 in hexadecimal, of 64 letters and digits";
            return Err(Problem::new(Code::InvalidValue, detail).at("/digest", Vec::new()));
        }
        let file_name = (!file_name.is_empty()).then_some(file_name);
        Ok(NewFetch { url: self.url, file_name, digest: self.digest.map(|text| text.to_ascii_lowercase()) })
    }
}

/// Uploads a file.
///
/// The body is the file itself. The same bytes of the same format under the same name are kept once: uploading them again gives the asset
/// that is there, kept for longer. Where the operator allows it, `POST /v1/assets/by-url` fetches a file instead; its JSON is understood
/// here too.
#[utoipa::path(post, path = "/v1/assets", operation_id = "upload_asset", tag = "assets", params(CreateQuery,
    ("Content-Digest" = Option<String>, Header, description = "`sha-256=:…:` of the body; checked")),
    request_body(description = "the file", content = String, content_type = "application/octet-stream"),
    responses((status = 201, body = AssetView, description = "kept", headers(("Location" = String))),
        (status = 200, body = AssetView, description = "the asset exists already")))]
async fn create(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    QueryOf(query): QueryOf<CreateQuery>,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let (asset, is_new) = if is_media_type(request.headers(), "application/json") {
        let JsonBody(body) = JsonBody::<NewAssetByUrl>::from_request(request, &state).await?;
        state.assets.fetch(&owner, body.read(clean_name(&query.filename))?).await?
    } else {
        BodyReader::new(request, &state.settings).asset(&state.assets, &owner, &query.filename).await?
    };
    Ok(kept(asset, is_new))
}

/// An asset that was asked to be kept.
fn kept(asset: AssetRecord, is_new: bool) -> Response {
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    let location = [(header::LOCATION, ascii(format!("/v1/assets/{}", asset.id)))];
    (status, location, Json(AssetView::from(asset))).into_response()
}

/// Fetches a file from a URL.
///
/// Where the operator allows it (`--url-input on`): under the limits of uploads, from public addresses alone, over up to three redirects.
#[utoipa::path(post, path = "/v1/assets/by-url", operation_id = "fetch_asset", tag = "assets", params(CreateQuery),
    request_body(description = "where the file is", content = NewAssetByUrl),
    responses((status = 201, body = AssetView, description = "kept", headers(("Location" = String))),
        (status = 200, body = AssetView, description = "these bytes are here already")))]
async fn fetch(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    QueryOf(query): QueryOf<CreateQuery>,
    JsonBody(body): JsonBody<NewAssetByUrl>,
) -> Result<Response, Problem> {
    let (asset, is_new) = state.assets.fetch(&owner, body.read(clean_name(&query.filename))?).await?;
    Ok(kept(asset, is_new))
}

/// Lists uploaded files, newest first.
#[utoipa::path(get, path = "/v1/assets", operation_id = "list_assets", tag = "assets", params(PageQuery),
    responses((status = 200, body = AssetPageView, description = "a page")))]
async fn list(
    State(assets): State<Assets>,
    State(settings): State<Shared<Settings>>,
    Caller(owner): Caller,
    QueryOf(query): QueryOf<PageQuery>,
) -> Result<Json<AssetPageView>, Problem> {
    let before = page::read_cursor(query.cursor.as_deref(), "", |text| AssetId::parse(text).ok())?;
    let found =
        assets.list(&owner, before.as_ref(), page::items(query.limit.as_deref(), settings.max_page_items)?).await?;
    let next_cursor = page::next_cursor(&found, "", |asset| asset.id.to_string());
    let items = found.items.into_iter().map(AssetView::from).collect();
    Ok(Json(AssetPageView { items, next_cursor }))
}

/// Shows a file.
#[utoipa::path(get, path = "/v1/assets/{id}", operation_id = "show_asset", tag = "assets", params(("id" = String, Path, description = "the asset")),
    responses((status = 200, body = AssetView, description = "the asset")))]
async fn show(
    State(assets): State<Assets>,
    Caller(owner): Caller,
    Id(id): Id<AssetId>,
) -> Result<Json<AssetView>, Problem> {
    Ok(Json(assets.get(&owner, &id).await?.into()))
}

/// Deletes a file.
///
/// Refused while an unfinished job uses it.
#[utoipa::path(delete, path = "/v1/assets/{id}", operation_id = "delete_asset", tag = "assets", params(("id" = String, Path, description = "the asset")),
    responses((status = 204, description = "removed")))]
async fn delete(
    State(assets): State<Assets>,
    Caller(owner): Caller,
    Id(id): Id<AssetId>,
) -> Result<StatusCode, Problem> {
    assets.delete(&owner, &id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Downloads a file.
#[utoipa::path(get, path = "/v1/assets/{id}/content", operation_id = "download_asset", tag = "assets", params(("id" = String, Path, description = "the asset"),
    ("Range" = Option<String>, Header, description = "one range of bytes")),
    responses((status = 200, content_type = "*/*", body = String, description = "the bytes"),
        (status = 206, content_type = "*/*", body = String, description = "a range of the bytes"),
        (status = 304, description = "not modified")))]
async fn content(
    State(assets): State<Assets>,
    State(jobs): State<Jobs>,
    Caller(owner): Caller,
    Id(id): Id<AssetId>,
    method: Method,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    File::from(assets.get(&owner, &id).await?).answer(&method, &headers, &jobs).await
}

/// What a file holds.
#[derive(ToSchema)]
#[schema(as = Skeleton)]
#[allow(dead_code, reason = "only its schema is used: the engine writes the answer")]
struct SkeletonView {
    /// Wire name of the format.
    #[schema(example = "glb")]
    format: String,
    /// `nodes`, `joints`, `skins`, `clips`.
    #[schema(value_type = Object)]
    counts: serde_json::Value,
    /// Of a drawing `size`, `mask_pixels`, `mask_parts`, `ends`, `joints_outside`, `annotated` and `joints`.
    #[schema(value_type = Option<Object>)]
    drawing: Option<serde_json::Value>,
    /// The largest body: `name`, `recognised_as`, `confidence`, `kind`, `rest_pose`, `rest_source`, `forward`, `up`,
    /// `height_meters`, `joints`, `roles`, `role_details` (confidence, alternatives and reasons of each role), `twist_helpers`,
    /// `twists` (the same with segment and place), `props`.
    /// Empty where there is no skeleton.
    #[schema(value_type = Vec<Object>)]
    rigs: serde_json::Value,
    /// `name`, `frames`, `fps`, `duration_seconds` and `animated_joints` of each animation.
    #[schema(value_type = Vec<Object>)]
    clips: serde_json::Value,
    /// What is wrong, odd or worth knowing, the worst first.
    findings: Vec<FindingView>,
    /// Guesses, repairs and losses: `code`, `place`, `detail`, `hint`.
    #[schema(value_type = Vec<Object>)]
    warnings: serde_json::Value,
}

/// Something about a file that its owner should know.
#[derive(ToSchema)]
#[schema(as = Finding)]
#[allow(dead_code, reason = "only its schema is used: the engine writes the answer")]
struct FindingView {
    /// Stable; `GET /v1/findings` explains each.
    #[schema(schema_with = finding_codes)]
    code: String,
    /// `error`, `warning` or `note`.
    severity: String,
    /// The joint, clip or skin that it was seen at first; empty where it is about the whole file.
    place: String,
    /// What was seen.
    detail: String,
    /// What to do about it.
    fix: String,
}

fn finding_codes() -> utoipa::openapi::schema::Object {
    utoipa::openapi::ObjectBuilder::new()
        .schema_type(utoipa::openapi::schema::Type::String)
        .enum_values(Some(FindingCode::ALL.iter().map(|code| code.name())))
        .description(Some("Stable; `GET /v1/findings` explains each."))
        .build()
}

/// Inspects a file.
///
/// Skeletons, clips, the recognized rig, roles with confidence, the kind of rest pose, units, findings (problems and
/// oddities, each with a fix) and warnings. Your own rig templates take part in the recognition.
#[utoipa::path(get, path = "/v1/assets/{id}/skeleton", operation_id = "show_skeleton", tag = "assets", params(("id" = String, Path, description = "the asset")),
    responses((status = 200, body = SkeletonView, description = "the contents of the file, as `retargetd inspect --json` prints them")))]
async fn skeleton(
    State(assets): State<Assets>,
    Caller(owner): Caller,
    Id(id): Id<AssetId>,
) -> Result<Response, Problem> {
    Ok(crate::http::json_text(assets.inspect(&owner, &id).await?.to_string()))
}
