//! Answers that never change while what they are made of is kept: callers keep them, and ask again by their tag.

use axum::{
    body::{Body, Bytes},
    http::{HeaderMap, HeaderValue, StatusCode, header},
    response::{IntoResponse, Response},
};

use super::{download::ascii, precondition, problem::Problem};
use crate::jobs::Refusal;

/// What is made, or 304 where the caller has what has this key; it is not made then.
///
/// # Errors
/// When it cannot be made.
pub(super) async fn unchanging(
    headers: &HeaderMap,
    key: &str,
    media_type: &'static str,
    make: impl Future<Output = Result<Bytes, Refusal>>,
) -> Result<Response, Problem> {
    precondition::check_read(headers, key)?;
    let mut response = if precondition::caller_has(headers, key) {
        StatusCode::NOT_MODIFIED.into_response()
    } else {
        let mut response = Body::from(make.await?).into_response();
        response.headers_mut().insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type));
        response
    };
    response.headers_mut().insert(header::ETAG, ascii(format!("\"{key}\"")));
    let immutable = HeaderValue::from_static("private, max-age=31536000, immutable");
    response.headers_mut().insert(header::CACHE_CONTROL, immutable);
    Ok(response)
}
