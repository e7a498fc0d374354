//! Headers that keep browsers from doing what nobody asked for.

use axum::{
    extract::Request,
    http::{HeaderValue, header},
    middleware::Next,
    response::Response,
};

use crate::http::docs::PAGE_POLICY;

/// The API serves no pages, so nothing may run.
const API_POLICY: HeaderValue = HeaderValue::from_static("default-src 'none'; frame-ancestors 'none'; sandbox");

pub(super) async fn add_security_headers(request: Request, next: Next) -> Response {
    let is_docs = ["/docs", "/problems"].iter().any(|path| request.uri().path().starts_with(path));
    let mut response = next.run(request).await;
    let headers = response.headers_mut();
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    headers.insert(header::REFERRER_POLICY, HeaderValue::from_static("no-referrer"));
    // A page says itself what it needs.
    headers.entry(header::CONTENT_SECURITY_POLICY).or_insert(if is_docs { PAGE_POLICY } else { API_POLICY });
    // What says nothing of caching is true only now.
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}
