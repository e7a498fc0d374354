//! What happens around every request: ids, log lines, metrics, spans, headers, lingering, and writing problems.

mod admission;
mod compress;
mod cors;
mod headers;
mod linger;
mod observe;
mod problems;
mod refused;
mod request_id;
mod trace;

use axum::{Router, middleware};
use tower_http::catch_panic::CatchPanicLayer;

pub(super) use compress::Unpacked;
pub(super) use request_id::RequestId;

use super::{ApiState, auth, heavy, problem::Problem};

/// Wraps the routes of probes: problems are written and ids given as everywhere; nothing is logged, nobody is asked for a key.
pub(super) fn wrap_probes<S: Clone + Send + Sync + 'static>(router: Router<S>) -> Router<S> {
    router
        .layer(middleware::from_fn(problems::write_problem))
        .layer(middleware::from_fn(headers::add_security_headers))
        .layer(middleware::from_fn(request_id::identify))
}

/// Wraps the routes. The last layer is the outermost: ids exist before anything is logged, and problems are written after
/// everything that can cause one.
pub(super) fn wrap(router: Router<ApiState>, state: &ApiState) -> Router<ApiState> {
    let router = router
        .layer(middleware::from_fn_with_state(state.clone(), heavy::apart))
        .layer(CatchPanicLayer::custom(|_: Box<dyn std::any::Any + Send>| {
            axum::response::IntoResponse::into_response(Problem::internal(&"a handler panicked"))
        }))
        .layer(middleware::from_fn_with_state(state.clone(), trace::trace))
        .layer(middleware::from_fn_with_state(state.clone(), auth::authenticate))
        .layer(middleware::from_fn_with_state(state.clone(), admission::bound_concurrency))
        .layer(middleware::from_fn(refused::refuse_what_nobody_understands))
        .layer(middleware::from_fn_with_state(state.clone(), linger::linger))
        .layer(middleware::from_fn(problems::write_problem))
        .layer(compress::layer())
        .layer(middleware::from_fn(compress::weaken_tags))
        .layer(middleware::from_fn(observe::observe))
        .layer(middleware::from_fn(headers::add_security_headers));
    let origins = &state.settings.cors_origins;
    let router = if origins.0.is_empty() { router } else { router.layer(cors::layer(origins)) };
    router.layer(middleware::from_fn(request_id::identify))
}
