//! The OpenAPI document, made from the routes, and the page that shows it.

mod operations;

use std::sync::OnceLock;

use axum::{
    Router,
    http::header,
    response::{Html, IntoResponse, Response},
    routing::get,
};
use utoipa::{OpenApi, openapi::OpenApi as Document};
use utoipa_axum::router::OpenApiRouter;
use utoipa_swagger_ui::{Config, SwaggerUi};

use super::{
    ApiState,
    code::{Code, problems_page},
    json_text,
    problem::Problem,
    resources,
};
use crate::{engine::edits_page, samples::walk_scene};

#[derive(OpenApi)]
#[openapi(
    info(title = "retargetd", description = "Moves character animation from any rig to any rig."),
    components(schemas(resources::events::JobEventView)),
    tags(
        (name = "retarget", description = "Files in, file out"),
        (name = "assets", description = "Uploaded files"),
        (name = "jobs", description = "Retargets that run by themselves"),
        (name = "events", description = "What happens, as it happens"),
        (name = "webhooks", description = "Being told what happened"),
        (name = "results", description = "The files that jobs gave"),
        (name = "rigs", description = "What rigs are and how they belong together"),
        (name = "keys", description = "Who may come in"),
        (name = "service", description = "What the service says of itself"),
    )
)]
struct Api;

/// The routes that the document describes.
pub(super) fn documented_routes() -> OpenApiRouter<ApiState> {
    OpenApiRouter::with_openapi(Api::openapi())
        .merge(resources::retarget::routes())
        .merge(resources::poses::routes())
        .merge(resources::edits::routes())
        .merge(resources::assets::routes())
        .merge(resources::jobs::routes())
        .merge(resources::events::routes())
        .merge(resources::proposals::routes())
        .merge(resources::explanations::routes())
        .merge(resources::library::routes())
        .merge(resources::results::routes())
        .merge(resources::webhooks::routes())
        .merge(resources::keys::routes())
        .merge(resources::usage::routes())
        .merge(resources::describe::routes())
        .merge(resources::probes::routes())
}

/// The OpenAPI document of the service.
#[must_use]
pub fn openapi_document() -> Document {
    let mut document = documented_routes().into_openapi();
    operations::tell_who_may_come_in(&mut document);
    operations::tell_what_leads_where(&mut document);
    document
}

/// The document itself, and the page that shows it. Everything that the page needs is in the binary.
pub(super) fn pages() -> Router<ApiState> {
    let page = SwaggerUi::new("/docs").config(Config::from("/openapi.json"));
    Router::new()
        .route("/openapi.json", get(document))
        .route("/problems", get(problems))
        .route("/docs/edits", get(edits))
        .merge(Router::from(page))
}

/// What every edit does to a walk, in curves.
async fn edits() -> Response {
    static PAGE: OnceLock<Option<String>> = OnceLock::new();
    match PAGE.get_or_init(|| edits_page(&walk_scene()).ok()) {
        Some(page) => Html(page.as_str()).into_response(),
        None => Problem::new(Code::Internal, "the page of edits could not be made").into_response(),
    }
}

/// The page that the `type` of every problem points to.
async fn problems() -> Response {
    ([(header::CONTENT_TYPE, "text/markdown; charset=utf-8")], problems_page()).into_response()
}

async fn document() -> Response {
    static TEXT: OnceLock<String> = OnceLock::new();
    let text = TEXT.get_or_init(|| openapi_document().to_pretty_json().unwrap_or_default());
    json_text(text.clone())
}
