//! Bounds how many requests are worked on at the same time. Probes are always answered.

use axum::{
    extract::{Request, State},
    middleware::Next,
    response::{IntoResponse, Response},
};

use crate::{
    http::{ApiState, code::Code, problem::Problem},
    telemetry::Metric,
};

pub(super) async fn bound_concurrency(State(state): State<ApiState>, request: Request, next: Next) -> Response {
    if matches!(request.uri().path(), "/livez" | "/readyz" | "/metrics") {
        return next.run(request).await;
    }
    let Ok(_permit) = state.requests.try_acquire() else {
        Metric::AdmissionRejected.count([("reason", "too_busy".to_owned())], 1);
        let most = state.settings.max_concurrent_requests;
        return Problem::new(Code::TooBusy, "too many requests are being worked on")
            .about_limit("concurrent_requests", most, most + 1)
            .into_response();
    };
    next.run(request).await
}
