//! The one way in which bodies are read: bounded in bytes and in time, whatever they say of themselves and however they are sent.

use std::{
    fmt,
    pin::Pin,
    sync::{Arc, Mutex, PoisonError},
    task::{Context, Poll, ready},
};

use axum::body::{Body, BodyDataStream, Bytes};
use futures::Stream;
use tokio::time::Instant;

use super::{code::Code, pace::Pace, problem::Problem};
use crate::config::Settings;

/// Bytes that a multipart body may send without a part beginning or going on: what stands before the first part, and the headers of one.
const MAX_IDLE_BYTES: u64 = 64 << 10;

/// A body as it arrives. It ends with an error where it breaks a bound.
pub(super) struct BoundedBody {
    chunks: BodyDataStream,
    pace: Pace,
    end: Instant,
    max_bytes: u64,
    bytes: u64,
    watch: BodyWatch,
}

/// What is known of a body while somebody else reads it.
#[derive(Clone, Default)]
pub(super) struct BodyWatch(Arc<Mutex<Watched>>);

#[derive(Default)]
struct Watched {
    /// Whether bytes must lead to a part soon.
    has_parts: bool,
    /// Bytes since the last part began or went on.
    idle_bytes: u64,
    refusal: Option<Problem>,
}

/// A body broke a bound; its watch says which.
#[derive(Debug)]
pub(super) struct OutOfBounds;

impl fmt::Display for OutOfBounds {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("the body breaks a bound")
    }
}

impl std::error::Error for OutOfBounds {}

impl BoundedBody {
    pub(super) fn new(body: Body, settings: &Settings) -> Self {
        Self {
            chunks: body.into_data_stream(),
            pace: Pace::new(settings.upload_idle_timeout.0, settings.min_transfer_rate.0),
            end: Instant::now() + settings.upload_timeout.0,
            max_bytes: settings.max_request_bytes.0,
            bytes: 0,
            watch: BodyWatch::default(),
        }
    }

    /// The same, of which parts are expected, with who hears of them.
    pub(super) fn of_parts(self) -> (Self, BodyWatch) {
        self.watch.lock().has_parts = true;
        let watch = self.watch.clone();
        (self, watch)
    }

    /// What broke a bound, else what is said.
    pub(super) fn refusal(&self, otherwise: impl FnOnce() -> Problem) -> Problem {
        self.watch.refusal(otherwise)
    }

    fn refuse(&self, problem: Problem) -> Poll<Option<Result<Bytes, axum::Error>>> {
        self.watch.lock().refusal = Some(problem);
        Poll::Ready(Some(Err(axum::Error::new(OutOfBounds))))
    }

    fn too_slow(&self) -> Problem {
        let detail = if Instant::now() >= self.end {
            "the upload took longer than 'upload_timeout' allows".to_owned()
        } else {
            let seconds = self.pace.period().as_secs_f64();
            format!("the upload paused longer than 'upload_idle_timeout' of {seconds} seconds allows")
        };
        Problem::new(Code::UploadTooSlow, detail).with_hint("nothing was kept; send it again")
    }

    fn accept(&mut self, chunk: Bytes) -> Poll<Option<Result<Bytes, axum::Error>>> {
        if !self.pace.pass(chunk.len()) {
            let detail = "the upload is slower than 'min_transfer_rate' allows";
            return self.refuse(
                Problem::new(Code::UploadTooSlow, detail).with_hint("nothing was kept; send it again, faster"),
            );
        }
        self.bytes += chunk.len() as u64;
        if self.bytes > self.max_bytes {
            return self.refuse(too_large("the request", "request_bytes", self.max_bytes, self.bytes));
        }
        let idle_bytes = {
            let mut watched = self.watch.lock();
            let before = watched.idle_bytes;
            watched.idle_bytes += chunk.len() as u64;
            // One chunk may hold the end of a part and the whole of the next one's headers.
            if watched.has_parts { before } else { 0 }
        };
        if idle_bytes > MAX_IDLE_BYTES {
            let detail = format!("more than {MAX_IDLE_BYTES} bytes came and no part began or went on");
            return self.refuse(
                Problem::new(Code::MalformedRequest, format!("the multipart body cannot be read: {detail}"))
                    .with_hint("the headers of a part, and what stands before the first one, are short"),
            );
        }
        Poll::Ready(Some(Ok(chunk)))
    }
}

impl Stream for BoundedBody {
    type Item = Result<Bytes, axum::Error>;

    fn poll_next(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<Option<Self::Item>> {
        let body = &mut *self;
        match Pin::new(&mut body.chunks).poll_next(context) {
            Poll::Ready(Some(Ok(chunk))) => body.accept(chunk),
            Poll::Ready(other) => Poll::Ready(other),
            Poll::Pending => {
                let end = body.end;
                ready!(body.pace.poll_wait(context, Some(end)));
                let problem = body.too_slow();
                body.refuse(problem)
            }
        }
    }
}

impl BodyWatch {
    /// A part has begun or gone on.
    pub(super) fn advance(&self) {
        self.lock().idle_bytes = 0;
    }

    /// What broke a bound, else what is said.
    pub(super) fn refusal(&self, otherwise: impl FnOnce() -> Problem) -> Problem {
        self.lock().refusal.take().unwrap_or_else(otherwise)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Watched> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// More than a limit allows.
pub(super) fn too_large(what: &str, limit: &'static str, most: u64, actual: u64) -> Problem {
    Problem::new(Code::BodyTooLarge, format!("{what} is larger than the limit '{limit}' of {most} bytes allows"))
        .about_limit(limit, most, actual)
}
