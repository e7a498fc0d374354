//! Every request has an id: the caller's own, or one of ours. It is in the log, in problems and in the answer.

use axum::{
    extract::Request,
    http::{HeaderName, HeaderValue},
    middleware::Next,
    response::Response,
};

/// The id of a request.
#[derive(Clone, Debug)]
pub(in crate::http) struct RequestId(pub(in crate::http) HeaderValue);

impl RequestId {
    pub(in crate::http) fn as_str(&self) -> &str {
        self.0.to_str().unwrap_or_default()
    }
}

const NAME: HeaderName = HeaderName::from_static("x-request-id");

pub(super) async fn identify(mut request: Request, next: Next) -> Response {
    const MAX_LETTERS: usize = 128;
    let given = request.headers().get(NAME).filter(|value| {
        let is_plain = value.as_bytes().iter().all(u8::is_ascii_graphic);
        !value.is_empty() && value.len() <= MAX_LETTERS && is_plain
    });
    let id = given.cloned().unwrap_or_else(|| super::super::download::ascii(uuid::Uuid::now_v7().to_string()));
    request.extensions_mut().insert(RequestId(id.clone()));
    let mut response = next.run(request).await;
    response.headers_mut().insert(NAME, id);
    response
}
