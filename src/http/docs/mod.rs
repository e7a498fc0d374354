//! What the service serves of its documentation: the documents, the OpenAPI document made from the routes, and its explorer.

mod contract;
mod documents;
mod markdown;
mod operations;

use std::{collections::BTreeMap, sync::OnceLock};

use axum::{
    Router,
    http::{HeaderMap, HeaderValue, Uri, header},
    response::{Html, IntoResponse, Response},
    routing::get,
};
use serde_json::Value;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_swagger_ui::{Config, SwaggerUi};

use documents::Site;

use super::{
    ApiState,
    code::{Code, problems_page},
    json_text,
    negotiate::prefers_page,
    problem::{Problem, ProblemError, ProblemView},
    resources,
};
use crate::{
    engine::nearest,
    report::{Escaped, edits_article},
    samples::walk_scene,
};

/// Pages of the documentation run its own scripts and nobody else's.
pub(super) const PAGE_POLICY: HeaderValue = HeaderValue::from_static(
    "default-src 'self'; img-src 'self' data:; style-src 'self' 'unsafe-inline'; frame-ancestors 'none'",
);

#[derive(OpenApi)]
#[openapi(
    info(title = "retargetd", description = "Moves character animation from any rig to any rig."),
    components(schemas(resources::events::JobEventView)),
    tags(
        (name = "retarget", description = "Files in, file out"),
        (name = "drawings", description = "Drawn characters"),
        (name = "assets", description = "Uploaded files"),
        (name = "jobs", description = "Retargets that run by themselves"),
        (name = "batches", description = "Jobs that are asked for together"),
        (name = "events", description = "What happens, as it happens"),
        (name = "webhooks", description = "Notifications"),
        (name = "results", description = "The files that jobs gave"),
        (name = "rigs", description = "What rigs are and how they belong together"),
        (name = "keys", description = "Access"),
        (name = "service", description = "What the service says of itself"),
    )
)]
struct Api;

/// The routes that the document describes.
pub(super) fn documented_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(Api::openapi())
        .merge(resources::retarget::routes())
        .merge(resources::poses::routes())
        .merge(resources::previews::routes())
        .merge(resources::displays::routes())
        .merge(resources::comparisons::routes())
        .merge(resources::drawing_annotations::routes())
        .merge(resources::edits::routes())
        .merge(resources::drawings::routes())
        .merge(resources::assets::routes())
        .merge(resources::jobs::routes())
        .merge(resources::batches::routes())
        .merge(resources::events::routes())
        .merge(resources::proposals::routes())
        .merge(resources::explanations::routes())
        .merge(resources::library::routes())
        .merge(resources::results::routes())
        .merge(resources::webhooks::routes())
        .merge(resources::keys::routes())
        .merge(resources::usage::routes())
        .merge(resources::info::routes())
        .merge(resources::probes::routes())
}

/// The OpenAPI document of the service.
#[must_use]
pub fn openapi_document() -> Value {
    let mut document = documented_routes().into_openapi();
    operations::tell_who_may_come_in(&mut document);
    operations::tell_what_leads_where(&mut document);
    contract::of(&document)
}

/// The methods of a documented route, as they are told; nothing where it is none.
pub(super) fn methods_of(route: &str) -> &'static str {
    methods().get(route).map_or("", String::as_str)
}

/// Documented routes that look like a path that is none.
pub(super) fn routes_like(path: &str) -> Vec<String> {
    /// No route is longer.
    const MAX_LETTERS: usize = 80;
    if path.len() > MAX_LETTERS {
        return Vec::new();
    }
    // An id stands for any.
    let is_id = |part: &str| part.len() == "job_".len() + 26 && part.as_bytes().get(3) == Some(&b'_');
    let parts: Vec<&str> = path.trim_end_matches('/').split('/').collect();
    let general: Vec<&str> = parts.iter().map(|part| if is_id(part) { "{id}" } else { part }).collect();
    let general = general.join("/");
    let of_api = if general.starts_with("/v1") { general } else { format!("/v1{general}") };
    nearest(&of_api, methods().keys().map(String::as_str))
}

/// The methods of every documented route.
fn methods() -> &'static BTreeMap<String, String> {
    static METHODS: OnceLock<BTreeMap<String, String>> = OnceLock::new();
    METHODS.get_or_init(|| {
        let document = openapi_document();
        let paths = document["paths"].as_object().into_iter().flatten();
        let told = |(path, item): (&String, &Value)| {
            let methods = item.as_object().into_iter().flat_map(|item| item.keys().map(|name| name.to_uppercase()));
            (path.clone(), methods.collect::<Vec<_>>().join(", "))
        };
        paths.map(told).collect()
    })
}

/// The documents, the OpenAPI document and its explorer. Everything that the pages need is in the binary.
pub(super) fn pages() -> Router<ApiState> {
    let explorer = SwaggerUi::new("/docs/api").config(Config::from("/openapi.json"));
    Router::new()
        .route("/openapi.json", get(document))
        .route("/problems", get(problems))
        .route("/docs", get(page))
        .route("/docs/", get(page))
        .route("/docs/{*page}", get(page))
        .route("/docs/edits", get(edits))
        .route("/docs/site/page.css", get(async || text("text/css", include_str!("site/page.css"))))
        .route("/docs/site/icon.svg", get(async || text("image/svg+xml", include_str!("../../../studio/icon.svg"))))
        .route("/docs/site/search.js", get(async || text("text/javascript", include_str!("site/search.js"))))
        .route("/docs/site/search.json", get(async || text("application/json", &Site::get().search_index)))
        .merge(Router::from(explorer))
}

/// A page of the documents, or a file that one links to.
async fn page(uri: Uri) -> Response {
    let address = uri.path().trim_end_matches('/').trim_end_matches(".md");
    match (Site::get().page(address), documents::file(uri.path())) {
        (Some(page), _) => Html(page).into_response(),
        (None, Some(file)) => ([(header::CONTENT_TYPE, file.media_type)], file.bytes).into_response(),
        (None, None) => {
            Problem::new(Code::NotFound, "there is no such page").with_hint("GET /docs lists all pages").into_response()
        }
    }
}

/// Text that never changes while the process runs.
fn text(media_type: &str, text: &'static str) -> Response {
    ([(header::CONTENT_TYPE, format!("{media_type}; charset=utf-8"))], text).into_response()
}

/// What every edit does to a walk, in curves.
async fn edits() -> Response {
    static PAGE: OnceLock<Option<String>> = OnceLock::new();
    let made = || edits_article(&walk_scene()).ok().map(|article| Site::get().page_around("What edits do", &article));
    match PAGE.get_or_init(made) {
        Some(page) => Html(page.as_str()).into_response(),
        None => Problem::new(Code::Internal, "the page of edits could not be made").into_response(),
    }
}

/// The page that the `type` of every problem points to: HTML for browsers, Markdown for others.
async fn problems(headers: HeaderMap) -> Response {
    static PAGE: OnceLock<String> = OnceLock::new();
    let accept = headers.get(header::ACCEPT).and_then(|value| value.to_str().ok()).unwrap_or_default();
    if prefers_page(accept) {
        let page = PAGE.get_or_init(|| with_anchors(Site::get().page_of(&problems_page())));
        return Html(page.as_str()).into_response();
    }
    ([(header::CONTENT_TYPE, "text/markdown; charset=utf-8")], problems_page()).into_response()
}

/// A problem as a page for people, in the frame of the documents.
pub(super) fn problem_page(problem: &ProblemView) -> String {
    let mut body = format!(
        "<h1>{}</h1><p class=\"status\">{} <code>{}</code></p>",
        Escaped(problem.title),
        problem.status,
        problem.code
    );
    body.push_str(&format!("<p>{}</p>", Escaped(&problem.detail)));
    if !problem.hint.is_empty() {
        body.push_str(&format!("<p class=\"hint\">{}</p>", Escaped(&problem.hint)));
    }
    // One thing that is wrong is told by the detail.
    if problem.errors.len() > 1 {
        let item = |error: &ProblemError| {
            format!("<li><code>{}</code> {}</li>", Escaped(&error.pointer), Escaped(&error.detail))
        };
        body.push_str(&format!("<ul>{}</ul>", problem.errors.iter().map(item).collect::<String>()));
    }
    body.push_str(&format!(
        "<p><a href=\"{}\">What this problem means</a> · <a href=\"/docs\">Documents</a></p>",
        problem.kind
    ));
    body.push_str(&format!(
        "<p class=\"faint\"><code>{}</code>, request {}</p>",
        Escaped(&problem.instance),
        Escaped(&problem.request_id)
    ));
    Site::get().page_around(problem.title, &body)
}

/// Names the row of each code, so that `/problems#code` leads to it.
fn with_anchors(page: String) -> String {
    Code::ALL.iter().fold(page, |page, code| {
        let name = code.name();
        page.replace(&format!("<tr><td><code>{name}</code>"), &format!("<tr id=\"{name}\"><td><code>{name}</code>"))
    })
}

async fn document() -> Response {
    static TEXT: OnceLock<String> = OnceLock::new();
    let text = TEXT.get_or_init(|| format!("{:#}", openapi_document()));
    json_text(text.clone())
}
