//! Requests whose bodies take the processor more than a moment to read have a thread of their own, so that however many come, all others are
//! answered as fast as without them.

use std::{io, sync::Arc, thread};

use axum::{
    extract::{Request, State},
    http::header,
    middleware::Next,
    response::{IntoResponse, Response},
};
use tokio::{runtime::Handle, sync::oneshot, task::JoinHandle};
use tracing::{Instrument as _, Span};

use super::{ApiState, problem::Problem, turns::Spent};
use crate::{jobs::give_way_by, telemetry::TraceContext};

/// Larger documents are read on the thread for them: a mebibyte of JSON takes tens of milliseconds.
const MAX_LIGHT_BYTES: u64 = 64 << 10;
/// By how much the thread gives way to others where the processor is short.
const NICE: i32 = 5;

/// The thread. Cheap to clone; it ends with the last of the clones.
#[derive(Clone, Debug)]
pub struct HeavyRequests {
    handle: Handle,
    _until_dropped: Arc<oneshot::Sender<()>>,
}

impl HeavyRequests {
    /// Starts it.
    ///
    /// # Errors
    /// When the system starts no thread.
    pub fn start() -> io::Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .thread_name("heavy-requests")
            .on_thread_start(give_way)
            .enable_all()
            .build()?;
        let handle = runtime.handle().clone();
        let (until_dropped, dropped) = oneshot::channel::<()>();
        thread::Builder::new().name("heavy-requests".to_owned()).spawn(move || {
            give_way();
            // An error says that the other end is gone, which is what is waited for.
            let _ = runtime.block_on(dropped);
            runtime.shutdown_background();
        })?;
        Ok(Self { handle, _until_dropped: Arc::new(until_dropped) })
    }
}

/// The thread gives way to others where the processor is short.
fn give_way() {
    give_way_by(NICE);
}

/// Ends what it stands for when the caller goes away.
struct Ending(JoinHandle<Response>);

impl Drop for Ending {
    fn drop(&mut self) {
        self.0.abort();
    }
}

/// Has large documents read on the thread for them.
pub(super) async fn apart(State(state): State<ApiState>, request: Request, next: Next) -> Response {
    if !is_heavy(&request) {
        return next.run(request).await;
    }
    let spent = request.extensions().get::<Spent>().cloned().unwrap_or_default();
    let work = async move { spent.count(next.run(request)).await };
    let work = TraceContext::cover(TraceContext::current(), work).instrument(Span::current());
    let mut answering = Ending(state.heavy.handle.spawn(work));
    match (&mut answering.0).await {
        Ok(response) => response,
        Err(error) => Problem::internal(&error).into_response(),
    }
}

/// Whether a request has a document for a body that is large or does not say how large it is. Files are not read here but kept, which
/// costs little.
fn is_heavy(request: &Request) -> bool {
    let text = |name| request.headers().get(name).and_then(|value| value.to_str().ok());
    let is_document = text(header::CONTENT_TYPE).is_some_and(|kind| kind.contains("json") || kind.contains("yaml"));
    let length: Option<u64> = text(header::CONTENT_LENGTH).and_then(|length| length.parse().ok());
    let has_body = length.is_some() || request.headers().contains_key(header::TRANSFER_ENCODING);
    is_document && has_body && length.is_none_or(|length| length > MAX_LIGHT_BYTES)
}

#[cfg(test)]
mod tests {
    use axum::body::Body;

    use super::*;

    fn request(headers: &[(&str, &str)]) -> Request {
        let builder = headers.iter().fold(Request::builder(), |builder, (name, value)| builder.header(*name, *value));
        builder.body(Body::empty()).expect("a request")
    }

    #[test]
    fn large_documents_are_heavy_and_files_are_not() {
        let json = ("content-type", "application/json; charset=utf-8");
        assert!(is_heavy(&request(&[json, ("content-length", "1048576")])), "large");
        assert!(is_heavy(&request(&[json, ("transfer-encoding", "chunked")])), "who knows");
        assert!(!is_heavy(&request(&[json, ("content-length", "300")])), "small");
        assert!(!is_heavy(&request(&[("content-type", "model/gltf-binary"), ("content-length", "9000000")])), "a file");
        assert!(!is_heavy(&request(&[json])), "no body");
    }

    #[tokio::test]
    async fn what_runs_apart_ends_when_nobody_waits_for_it() {
        let heavy = HeavyRequests::start().expect("a thread");
        let name = heavy.handle.spawn(async { thread::current().name().map(str::to_owned) }).await.expect("it runs");
        assert_eq!(name.as_deref(), Some("heavy-requests"), "on a thread of its own");
        let (began, has_begun) = oneshot::channel();
        let (ends, ended) = oneshot::channel::<()>();
        let waiting = Ending(heavy.handle.spawn(async move {
            let _held = ends;
            let _ = began.send(());
            std::future::pending::<Response>().await
        }));
        has_begun.await.expect("it has begun");
        drop(waiting);
        assert!(ended.await.is_err(), "it is dropped with who waited");
    }
}
