//! The answer about a job that goes on.

use axum::{
    Json,
    http::{StatusCode, header},
    response::{IntoResponse, Response},
};

use super::{download::ascii, views::JobView};
use crate::jobs::JobSnapshot;

/// A job that was taken on, or is still at work: where it is, and when to look again.
pub(super) fn accepted(snapshot: JobSnapshot, status: StatusCode) -> Response {
    /// Most jobs take less than this.
    const LOOK_AGAIN_SECONDS: &str = "1";
    let id = snapshot.record.id.to_string();
    let is_final = snapshot.record.state.is_final();
    let mut response = (status, Json(JobView::from(snapshot))).into_response();
    let headers = response.headers_mut();
    headers.insert("job-id", ascii(id.clone()));
    if status == StatusCode::ACCEPTED {
        headers.insert(header::LOCATION, ascii(format!("/v1/jobs/{id}")));
    }
    if !is_final {
        headers.insert(header::RETRY_AFTER, axum::http::HeaderValue::from_static(LOOK_AGAIN_SECONDS));
    }
    response
}
