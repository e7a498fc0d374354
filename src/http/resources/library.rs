//! `/v1/rigs` and `/v1/presets`: what users teach the service under a name.
//!
//! A document is answered as it is kept, so that it can be changed and sent back; what is known of it is in the headers and in the
//! list.

use axum::{
    Json,
    body::Body,
    extract::{FromRequest, Path, Request, State},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use utoipa_axum::{router::OpenApiRouter, routes};

use crate::{
    http::{
        ApiState,
        auth::Caller,
        code::Code,
        download::ascii,
        extract::{JsonBody, QueryOf},
        precondition,
        problem::Problem,
    },
    jobs::{AssetId, DocumentKind, Kept, Library, Precondition, Principal},
};

pub(in crate::http) fn routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::new()
        .routes(routes!(list_rigs))
        .routes(routes!(show_rig, put_rig, delete_rig))
        .routes(routes!(list_presets))
        .routes(routes!(show_preset, put_preset, delete_preset))
}

/// What is known of a rig or preset.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = NamedDocument)]
struct NamedDocumentView {
    /// What it is called.
    #[schema(example = "our_hero")]
    name: String,
    /// The same for people to read, where a rig says so.
    #[serde(skip_serializing_if = "String::is_empty")]
    title: String,
    /// Of rigs: `biped`, `quadruped` or `other`.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind: Option<String>,
    /// Whether it comes with the program, so that it cannot be changed.
    built_in: bool,
    /// Its version, from 1; absent where it comes with the program.
    #[serde(skip_serializing_if = "Option::is_none")]
    version: Option<u64>,
    /// When this version came.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    created_at: Option<String>,
    /// SHA-256 of the document, in hexadecimal; also its `ETag`.
    sha256: String,
    /// Where the document is.
    document: String,
}

/// Everything that is kept of a kind. There are as many as the limit `stored_documents` allows, so there is one page.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = NamedDocumentList)]
struct NamedDocumentListView {
    /// By name; those that come with the program first.
    items: Vec<NamedDocumentView>,
}

#[derive(Debug, Deserialize, IntoParams)]
#[serde(deny_unknown_fields)]
#[into_params(parameter_in = Query)]
struct VersionQuery {
    /// An earlier version. Kept while a job may refer to it.
    version: Option<u64>,
}

async fn list(
    library: &Library,
    owner: &Principal,
    kind: DocumentKind,
) -> Result<Json<NamedDocumentListView>, Problem> {
    let view = |kept: Kept| NamedDocumentView {
        title: text_of(&kept, "title").unwrap_or_default(),
        kind: text_of(&kept, "kind").filter(|_| kind == DocumentKind::Rig),
        built_in: kept.own.is_none(),
        version: kept.own.map(|(version, _)| version),
        created_at: kept.own.map(|(_, created_at)| created_at.to_string()),
        document: format!("/v1/{}s/{}", kind.name(), kept.name),
        sha256: kept.sha256,
        name: kept.name,
    };
    let items = library.list(owner, kind).await?.into_iter().map(view).collect();
    Ok(Json(NamedDocumentListView { items }))
}

fn text_of(kept: &Kept, member: &str) -> Option<String> {
    kept.document.get(member)?.as_str().map(str::to_owned)
}

async fn show(
    library: &Library,
    owner: &Principal,
    (kind, name): (DocumentKind, &str),
    version: Option<u64>,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let kept = library.get(owner, kind, name, version).await?;
    precondition::check_read(headers, &kept.sha256)?;
    let status =
        if precondition::caller_has(headers, &kept.sha256) { StatusCode::NOT_MODIFIED } else { StatusCode::OK };
    Ok(answer(kept, status))
}

/// A document that was sent, and what has to hold for it to be kept.
async fn received(request: Request<Body>, state: &ApiState) -> Result<(serde_json::Value, Precondition), Problem> {
    let precondition = precondition::of_change(request.headers())?;
    let JsonBody(document) = JsonBody::from_request(request, state).await?;
    Ok((document, precondition))
}

async fn keep(
    library: &Library,
    owner: &Principal,
    (kind, name): (DocumentKind, &str),
    document: &serde_json::Value,
    precondition: &Precondition,
) -> Result<Response, Problem> {
    let written = library.put(owner, kind, name, document, precondition).await?;
    let status = if written.is_new { StatusCode::CREATED } else { StatusCode::OK };
    let mut response = answer(written.kept, status);
    if written.is_new {
        response.headers_mut().insert(header::LOCATION, ascii(format!("/v1/{}s/{name}", kind.name())));
    }
    Ok(response)
}

async fn delete(
    library: &Library,
    owner: &Principal,
    (kind, name): (DocumentKind, &str),
    headers: &HeaderMap,
) -> Result<StatusCode, Problem> {
    library.delete(owner, kind, name, &precondition::of_change(headers)?).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// The document, with what is known of it in the headers.
fn answer(kept: Kept, status: StatusCode) -> Response {
    let Kept { document, sha256, own, .. } = kept;
    let mut response = if status == StatusCode::NOT_MODIFIED {
        status.into_response()
    } else {
        (status, Json(document)).into_response()
    };
    let headers = response.headers_mut();
    headers.insert(header::ETAG, ascii(format!("\"{sha256}\"")));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-cache"));
    if let Some((version, _)) = own {
        headers.insert("document-version", version.into());
    }
    response
}

/// Lists the rig templates.
///
/// Built-in ones first; they can be read, not changed.
#[utoipa::path(get, path = "/v1/rigs", tag = "rigs",
    responses((status = 200, body = NamedDocumentListView, description = "all of them")))]
async fn list_rigs(
    State(library): State<Library>,
    Caller(owner): Caller,
) -> Result<Json<NamedDocumentListView>, Problem> {
    list(&library, &owner, DocumentKind::Rig).await
}

/// Returns a rig template, in the form of a `PUT`.
#[utoipa::path(get, path = "/v1/rigs/{name}", tag = "rigs", params(("name" = String, Path, description = "what it is called"),
    VersionQuery, ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, body = Object, description = "the document", headers(("ETag" = String), ("Document-Version" = u64))),
        (status = 304, description = "not modified")))]
async fn show_rig(
    State(library): State<Library>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    QueryOf(query): QueryOf<VersionQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    show(&library, &owner, (DocumentKind::Rig, &name), query.version, &headers).await
}

/// Stores a rig template.
///
/// The body is a rig template: the joints of a rig and their roles; `GET /v1/schemas/rig-template` is its JSON
/// Schema, `GET /v1/rigs/{name}` of a built-in one an example. From then on it takes part in every recognition,
/// before the built-in ones: in jobs, `GET /v1/assets/{id}/skeleton` and mapping suggestions. Earlier jobs are not
/// affected.
///
/// `{"asset": "…"}` instead of a template derives one from an uploaded character: the names of its joints with their
/// recognized roles. The answer is the template, to be reviewed and corrected.
#[utoipa::path(put, path = "/v1/rigs/{name}", tag = "rigs",
    params(("name" = String, Path, description = "up to 64 lower-case letters, digits, `_` and `-`"),
        ("If-Match" = Option<String>, Header, description = "change only the version with this `ETag`"),
        ("If-None-Match" = Option<String>, Header, description = "`*`: only if there is none of that name")),
    request_body(content = Object, content_type = "application/json", description = "the document"),
    responses((status = 201, body = Object, description = "kept", headers(("Location" = String), ("ETag" = String), ("Document-Version" = u64))),
        (status = 200, body = Object, description = "a new version, or the same as before", headers(("ETag" = String), ("Document-Version" = u64)))))]
async fn put_rig(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let (mut document, precondition) = received(request, &state).await?;
    if let Some(asset) = document.get("asset").filter(|_| document.as_object().is_some_and(|body| body.len() == 1)) {
        document = learned(&state, &owner, asset, &name).await?;
    }
    keep(&state.library, &owner, (DocumentKind::Rig, &name), &document, &precondition).await
}

/// The template of the rig in an uploaded file.
async fn learned(
    state: &ApiState,
    owner: &Principal,
    asset: &serde_json::Value,
    name: &str,
) -> Result<serde_json::Value, Problem> {
    let wrong =
        |detail: String| Problem::new(Code::InvalidValue, detail).with_hint("upload a character with named joints");
    let id = asset.as_str().and_then(|id| AssetId::parse(id).ok());
    let id = id.ok_or_else(|| wrong(format!("{asset} is not the id of an asset")))?;
    let inspection: serde_json::Value = serde_json::from_str(&state.assets.inspect(owner, &id).await?)
        .map_err(|error| Problem::new(Code::Internal, error.to_string()))?;
    let mut template = inspection.pointer("/rigs/0/template").cloned().unwrap_or_default();
    let Some(members) = template.as_object_mut() else {
        return Err(wrong(format!("the file of {id} has no body whose joints can be distinguished by name")));
    };
    members.insert("name".to_owned(), name.into());
    Ok(template)
}

/// Deletes a rig template.
///
/// Jobs that were submitted with it keep it.
#[utoipa::path(delete, path = "/v1/rigs/{name}", tag = "rigs", params(("name" = String, Path, description = "what it is called"),
    ("If-Match" = Option<String>, Header, description = "remove only the version with this `ETag`")),
    responses((status = 204, description = "removed")))]
async fn delete_rig(
    State(library): State<Library>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    headers: HeaderMap,
) -> Result<StatusCode, Problem> {
    delete(&library, &owner, (DocumentKind::Rig, &name), &headers).await
}

/// Lists the presets.
///
/// Built-in ones first; they can be read, not changed.
#[utoipa::path(get, path = "/v1/presets", tag = "rigs",
    responses((status = 200, body = NamedDocumentListView, description = "all of them")))]
async fn list_presets(
    State(library): State<Library>,
    Caller(owner): Caller,
) -> Result<Json<NamedDocumentListView>, Problem> {
    list(&library, &owner, DocumentKind::Preset).await
}

/// Returns a preset, in the form of a `PUT`.
#[utoipa::path(get, path = "/v1/presets/{name}", tag = "rigs", params(("name" = String, Path, description = "what it is called"),
    VersionQuery, ("If-None-Match" = Option<String>, Header, description = "`ETag` of the caller's copy")),
    responses((status = 200, body = Object, description = "the document", headers(("ETag" = String), ("Document-Version" = u64))),
        (status = 304, description = "not modified")))]
async fn show_preset(
    State(library): State<Library>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    QueryOf(query): QueryOf<VersionQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    show(&library, &owner, (DocumentKind::Preset, &name), query.version, &headers).await
}

/// Stores a preset.
///
/// The body is a retarget spec, or part of one. The config of a job that names it in `preset` extends it: objects are
/// merged member by member, any other value (lists too) of the config replaces that of the preset, and `null` removes
/// a member (RFC 7396). A config of another tool is converted to a retarget spec.
#[utoipa::path(put, path = "/v1/presets/{name}", tag = "rigs",
    params(("name" = String, Path, description = "up to 64 lower-case letters, digits, `_` and `-`"),
        ("If-Match" = Option<String>, Header, description = "change only the version with this `ETag`"),
        ("If-None-Match" = Option<String>, Header, description = "`*`: only if there is none of that name")),
    request_body(content = Object, content_type = "application/json", description = "the document"),
    responses((status = 201, body = Object, description = "kept", headers(("Location" = String), ("ETag" = String), ("Document-Version" = u64))),
        (status = 200, body = Object, description = "a new version, or the same as before", headers(("ETag" = String), ("Document-Version" = u64)))))]
async fn put_preset(
    State(state): State<ApiState>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    request: Request<Body>,
) -> Result<Response, Problem> {
    let (document, precondition) = received(request, &state).await?;
    keep(&state.library, &owner, (DocumentKind::Preset, &name), &document, &precondition).await
}

/// Deletes a preset.
///
/// Jobs that were submitted with it keep it.
#[utoipa::path(delete, path = "/v1/presets/{name}", tag = "rigs", params(("name" = String, Path, description = "what it is called"),
    ("If-Match" = Option<String>, Header, description = "remove only the version with this `ETag`")),
    responses((status = 204, description = "removed")))]
async fn delete_preset(
    State(library): State<Library>,
    Caller(owner): Caller,
    Path(name): Path<String>,
    headers: HeaderMap,
) -> Result<StatusCode, Problem> {
    delete(&library, &owner, (DocumentKind::Preset, &name), &headers).await
}
