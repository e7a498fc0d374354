//! The HTTP door: translation only.
//!
//! A request becomes a call to [`crate::jobs`], what comes back becomes a view. Nothing here schedules, stores or
//! retargets. Every unsuccessful answer is a problem with a code of [`Code`]; the routes are one resource per file in
//! `resources`, what happens around them is in `layers`.
//!
//! # How to add a route
//!
//! 1. Write the handler with its `utoipa::path` in the file of its resource, 25 lines at most, and add it to `routes`.
//! 2. What it refuses becomes a code: a row in `code.rs`.
//! 3. Render the document and the problems page again; the tests that compare them say how.

mod accepted;
mod auth;
mod body;
mod caching;
mod code;
mod connection;
mod digest;
mod docs;
mod download;
mod extract;
mod header_text;
mod heavy;
mod idempotency;
mod json_size;
mod judgment;
mod layers;
mod negotiate;
mod neighbors;
mod one_shot;
mod pace;
mod page;
mod picture_form;
mod places;
mod plain_words;
mod precondition;
mod prefer;
mod problem;
mod quota;
mod resources;
mod server;
mod shares;
mod studio;
mod turns;
mod unchanging;
mod upload;
mod views;

pub use code::{Code, problems_page};
pub use docs::openapi_document;
pub use heavy::HeavyRequests;
pub use problem::{Problem, ProblemError, ProblemView};
pub use server::{Server, ServerSettings};
pub use shares::Shares;
pub use turns::Turns;

use std::sync::Arc;

use axum::{
    Router,
    extract::FromRef,
    http::{Method, Uri, header},
    response::{IntoResponse, Response},
};
use tokio::sync::Semaphore;

use crate::{
    config::Settings,
    identity::Tokens,
    jobs::{Assets, Jobs, Keys, Library, Webhooks},
    telemetry::Metrics,
};

/// A shared value as a handler gets it.
pub(crate) type Shared<T> = Arc<T>;

/// What handlers work with. They ask for the part that they need.
#[derive(Clone, FromRef)]
pub struct ApiState {
    /// The jobs.
    pub jobs: Jobs,
    /// The uploaded files.
    pub assets: Assets,
    /// The rigs and presets.
    pub library: Library,
    /// The webhooks.
    pub webhooks: Webhooks,
    /// The keys with which callers say who they are.
    pub keys: Keys,
    /// The tokens of an identity provider that are taken beside keys.
    pub tokens: Tokens,
    /// The settings.
    pub settings: Shared<Settings>,
    /// The metrics.
    pub metrics: Metrics,
    /// Returns the JSON Schema of the retarget spec.
    #[from_ref(skip)]
    pub spec_schema: fn() -> &'static serde_json::Value,
    /// One permit per request that may be worked on at the same time.
    #[from_ref(skip)]
    pub requests: Arc<Semaphore>,
    /// How many of them each principal has.
    #[from_ref(skip)]
    pub shares: Shares,
    /// What each of them takes of the processor.
    #[from_ref(skip)]
    pub turns: Turns,
    /// Reads large documents apart from everything else.
    #[from_ref(skip)]
    pub heavy: HeavyRequests,
}

/// All routes, ready to be served.
pub fn router(state: ApiState) -> Router {
    let (routes, _) = docs::documented_routes().split_for_parts();
    let routes = routes.merge(docs::pages());
    let routes = if state.settings.studio.0 { routes.merge(studio::pages()) } else { routes };
    let routes = routes.fallback(no_route).method_not_allowed_fallback(no_method);
    layers::wrap(routes, &state).with_state(state)
}

/// What probes need to know.
#[derive(Clone, FromRef)]
struct ProbesState {
    jobs: Jobs,
    tokens: Tokens,
    metrics: Metrics,
}

/// The routes of probes and metrics alone, for a listener of their own that only the machines of the operator reach: no keys
/// are asked for, and no other request can be in the way.
pub fn probes_router(jobs: Jobs, tokens: Tokens, metrics: Metrics) -> Router {
    let (routes, _) = resources::probes::routes().split_for_parts();
    let routes = routes.fallback(no_route).method_not_allowed_fallback(no_method);
    layers::wrap_probes(routes).with_state(ProbesState { jobs, tokens, metrics })
}

/// The routes that are answered where a service has no place for more connections: whether it is alive, and whether it is ready.
pub fn reserved_router(jobs: Jobs, tokens: Tokens, metrics: Metrics) -> Router {
    let routes = resources::probes::health_routes().fallback(no_place);
    layers::wrap_probes(routes).with_state(ProbesState { jobs, tokens, metrics })
}

async fn no_place() -> Problem {
    Problem::new(Code::TooBusy, "there are too many connections")
}

async fn no_route(uri: Uri) -> Problem {
    let hint = match (docs::routes_like(uri.path()).first(), uri.path().split('/').nth(1)) {
        (Some(route), _) => format!("did you mean {route}? GET / lists where to go, GET /docs explains it"),
        (None, Some("v1" | "docs" | "studio")) => "GET / lists where to go, GET /docs explains it".to_owned(),
        _ => "routes of the API begin with /v1; GET / lists where to go, GET /docs explains it".to_owned(),
    };
    Problem::new(Code::NotFound, "there is no such route").with_hint(hint)
}

async fn no_method(method: Method) -> Problem {
    let shown: String = method.as_str().chars().take(16).collect();
    Problem::new(Code::MethodNotAllowed, format!("the method {shown} is not allowed here"))
}

/// A page that holds its own style and nothing else that a browser would fetch or run.
fn page_text(text: String) -> Response {
    let policy = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'; sandbox";
    let headers = [(header::CONTENT_TYPE, "text/html; charset=utf-8"), (header::CONTENT_SECURITY_POLICY, policy)];
    (headers, text).into_response()
}

/// An answer of JSON text that was made before.
fn json_text(text: String) -> Response {
    ([(header::CONTENT_TYPE, "application/json")], text).into_response()
}
