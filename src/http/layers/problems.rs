//! Writes the bodies of problems, and turns whatever a library answers into one.

use axum::{
    Json,
    extract::{MatchedPath, Request},
    http::{HeaderValue, StatusCode, header},
    middleware::Next,
    response::{Html, IntoResponse, Response},
};

use super::RequestId;
use crate::http::{
    code::Code,
    docs::{PAGE_POLICY, methods_of, problem_page},
    extract::{is_media_type, text},
    negotiate::prefers_page,
    problem::{Problem, ProblemView},
};

const MEDIA_TYPE: HeaderValue = HeaderValue::from_static("application/problem+json");

pub(super) async fn write_problem(request: Request, next: Next) -> Response {
    let path = request.uri().path().to_owned();
    let request_id = request.extensions().get::<RequestId>().cloned();
    let route = request.extensions().get::<MatchedPath>().cloned();
    let has_json = is_media_type(request.headers(), "application/json");
    let wants_page = prefers_page(text(request.headers(), &header::ACCEPT));
    let mut response = next.run(request).await;
    let problem = match response.extensions_mut().remove::<Box<Problem>>() {
        Some(problem) => *problem,
        None if needs_problem(&response) => of_status(response.status()),
        None => return response,
    };
    let problem = with_methods(problem, route.as_ref());
    let problem = if has_json { problem.in_body() } else { problem };
    let view = problem.view(&path, request_id.as_ref().map_or("", RequestId::as_str));
    if wants_page {
        return as_page(problem.code.status(), &view, &response);
    }
    let mut written = (problem.code.status(), Json(view)).into_response();
    for (name, value) in response.headers().iter().filter(|(name, _)| is_kept(name)) {
        written.headers_mut().insert(name.clone(), value.clone());
    }
    written.headers_mut().insert(header::CONTENT_TYPE, MEDIA_TYPE);
    written
}

/// The same for people: browsers say that they would rather have a page.
fn as_page(status: StatusCode, view: &ProblemView, before: &Response) -> Response {
    let mut written = (status, Html(problem_page(view))).into_response();
    for (name, value) in before.headers().iter().filter(|(name, _)| is_kept(name)) {
        written.headers_mut().insert(name.clone(), value.clone());
    }
    written.headers_mut().insert(header::CONTENT_SECURITY_POLICY, PAGE_POLICY);
    written
}

/// The methods of the route stand in the header `Allow`, which is written behind this layer, and are told to people here.
fn with_methods(problem: Problem, route: Option<&MatchedPath>) -> Problem {
    let methods = route.filter(|_| problem.code == Code::MethodNotAllowed).map(|route| methods_of(route.as_str()));
    match methods {
        Some(methods) if !methods.is_empty() => problem.with_hint(format!("this route takes {methods}")),
        _ => problem,
    }
}

fn is_kept(name: &header::HeaderName) -> bool {
    *name != header::CONTENT_LENGTH && *name != header::CONTENT_TYPE
}

fn needs_problem(response: &Response) -> bool {
    let status = response.status();
    let is_written = response.headers().get(header::CONTENT_TYPE) == Some(&MEDIA_TYPE);
    (status.is_client_error() || status.is_server_error()) && !is_written
}

/// What a library answered without telling more.
fn of_status(status: StatusCode) -> Problem {
    match status {
        StatusCode::NOT_FOUND => Problem::new(Code::NotFound, "there is no such route"),
        StatusCode::METHOD_NOT_ALLOWED => Problem::new(Code::MethodNotAllowed, "the method is not allowed here"),
        StatusCode::UNSUPPORTED_MEDIA_TYPE => Problem::new(Code::UnsupportedMediaType, "the body is of the wrong type"),
        StatusCode::PAYLOAD_TOO_LARGE => Problem::new(Code::BodyTooLarge, "the body is too large"),
        status if status.is_client_error() => Problem::new(Code::MalformedRequest, "the request cannot be read"),
        status => Problem::internal(&format!("a library answered {status}")),
    }
}
