//! What was refused is still received: a caller who is in the middle of sending hears the answer.
//!
//! A server that closes a connection with unread bytes resets it, and the reset overtakes the answer: the caller sees a
//! broken pipe where a problem said what is wrong. So the rest of a body that nobody wants is read and thrown away, for a
//! while, as web servers do under the name of a lingering close.

use std::{
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use axum::{
    body::{Body, Bytes, HttpBody},
    extract::{Request, State},
    http::header,
    middleware::Next,
    response::Response,
};
use futures::StreamExt;
use hyper::body::{Frame, SizeHint};

use crate::http::ApiState;

/// How long the rest of a body is received. Enough for what was on its way; too short to hold a connection for nothing.
const LONGEST: Duration = Duration::from_secs(5);

/// How long nothing may arrive. Who stopped sending is reading, or gone.
const LONGEST_PAUSE: Duration = Duration::from_millis(500);

pub(super) async fn linger(State(state): State<ApiState>, request: Request, next: Next) -> Response {
    // Who asks before sending is answered before anything was sent.
    if request.headers().contains_key(header::EXPECT) {
        return next.run(request).await;
    }
    let most_bytes = state.settings.max_request_bytes.0;
    next.run(request.map(|body| Body::new(LingeringBody { body: Some(body), most_bytes }))).await
}

/// A body whose rest is received when it is dropped before its end.
struct LingeringBody {
    /// Nothing once the end was reached.
    body: Option<Body>,
    most_bytes: u64,
}

impl HttpBody for LingeringBody {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let Some(body) = &mut self.body else {
            return Poll::Ready(None);
        };
        let arrived = std::task::ready!(Pin::new(body).poll_frame(context));
        if !matches!(arrived, Some(Ok(_))) {
            self.body = None;
        }
        Poll::Ready(arrived)
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map_or_else(|| SizeHint::with_exact(0), HttpBody::size_hint)
    }
}

impl Drop for LingeringBody {
    fn drop(&mut self) {
        let Some(body) = self.body.take().filter(|body| !body.is_end_stream()) else {
            return;
        };
        // Where no runtime is left there is no connection either.
        if let Ok(runtime) = tokio::runtime::Handle::try_current() {
            runtime.spawn(tokio::time::timeout(LONGEST, discard(body, self.most_bytes)));
        }
    }
}

async fn discard(body: Body, most_bytes: u64) {
    let mut chunks = body.into_data_stream();
    let mut left = most_bytes;
    while let Ok(Some(Ok(chunk))) = tokio::time::timeout(LONGEST_PAUSE, chunks.next()).await {
        left = left.saturating_sub(chunk.len() as u64);
        if left == 0 {
            return;
        }
    }
}
