//! Which answers are compressed for those who take them so: text that is not small, and what its maker says is made of plain numbers. Files
//! of formats that are packed already are left.

use axum::{
    body::HttpBody,
    extract::Request,
    http::{HeaderValue, Response, StatusCode, header},
    middleware::Next,
};
use tower_http::compression::{CompressionLayer, predicate::Predicate};

/// What is smaller goes into one packet anyway.
const MIN_BYTES: u64 = 1 << 10;
/// What is larger would take the processor longer than the network.
const MAX_BYTES: u64 = 32 << 20;

/// The layer.
pub(super) fn layer() -> CompressionLayer<Pays> {
    CompressionLayer::new().compress_when(Pays)
}

/// Beside an answer that says it is not packed, whatever its media type says.
#[derive(Clone, Copy, Debug)]
pub(in crate::http) struct Unpacked;

/// Whether it pays.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pays;

impl Predicate for Pays {
    fn should_compress<B: HttpBody>(&self, response: &Response<B>) -> bool {
        let kind = response.headers().get(header::CONTENT_TYPE).and_then(|kind| kind.to_str().ok()).unwrap_or_default();
        let kind = kind.split(';').next().unwrap_or_default().trim();
        let is_stream = kind == "text/event-stream";
        let is_text = kind.ends_with("json")
            || kind.starts_with("text/")
            || kind == "image/svg+xml"
            || response.extensions().get::<Unpacked>().is_some();
        let bytes = response.body().size_hint().exact();
        // A part of a file is a part of it as it is kept.
        let is_whole = response.status() != StatusCode::PARTIAL_CONTENT;
        is_text && !is_stream && is_whole && bytes.is_some_and(|bytes| (MIN_BYTES..=MAX_BYTES).contains(&bytes))
    }
}

/// A compressed file is not the same bytes, so its tag is a weak one (RFC 9110, section 8.8.1).
pub(super) async fn weaken_tags(request: Request, next: Next) -> axum::response::Response {
    let mut response = next.run(request).await;
    if !response.headers().contains_key(header::CONTENT_ENCODING) {
        return response;
    }
    let tag = response.headers().get(header::ETAG).and_then(|tag| tag.to_str().ok());
    let weak = tag.filter(|tag| !tag.starts_with("W/")).and_then(|tag| HeaderValue::try_from(format!("W/{tag}")).ok());
    if let Some(weak) = weak {
        response.headers_mut().insert(header::ETAG, weak);
    }
    response
}

#[cfg(test)]
mod tests {
    use axum::body::Body;

    use super::*;

    #[test]
    fn text_that_is_not_small_is_compressed_and_nothing_else() {
        let pays = |kind: &str, bytes: usize, status: u16| {
            let response = Response::builder().status(status).header(header::CONTENT_TYPE, kind);
            Pays.should_compress(&response.body(Body::from(vec![b'a'; bytes])).expect("a response"))
        };
        assert!(pays("application/json", 5_000, 200) && pays("text/html; charset=utf-8", 5_000, 200), "text");
        assert!(!pays("application/json", 100, 200), "too small");
        assert!(!pays("model/gltf-binary", 5_000, 200) && !pays("image/png", 5_000, 200), "packed already");
        let mut plain = Response::builder().header(header::CONTENT_TYPE, "model/gltf-binary");
        plain.extensions_mut().expect("no error so far").insert(Unpacked);
        assert!(Pays.should_compress(&plain.body(Body::from(vec![b'a'; 5_000])).expect("a response")), "plain numbers");
        assert!(!pays("text/plain", 5_000, 206) && !pays("text/event-stream", 5_000, 200), "parts and streams");
    }
}
