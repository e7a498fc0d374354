//! Connections: how many, how long their headers may take, and how they end.

use std::time::Duration;

use axum::Router;
use hyper::server::conn::{http1, http2};
use hyper_util::{
    rt::{TokioExecutor, TokioIo, TokioTimer},
    server::graceful::GracefulShutdown,
    service::TowerToHyperService,
};
use tokio::net::{TcpListener, TcpStream};
use tokio_util::sync::CancellationToken;

use super::{
    connection::ReadBackConnection,
    pace::Pace,
    places::{Place, Places},
};
use crate::telemetry::Metric;

/// What bounds connections.
#[derive(Clone, Copy, Debug)]
pub struct ServerSettings {
    /// Open connections. On a few more only probes are answered; others are told so and closed.
    pub most_connections: usize,
    /// Open connections from one address.
    pub most_peer_connections: usize,
    /// How long the reading of an answer may pause.
    pub answer_idle_timeout: Duration,
    /// Bytes a second that must be read while the service waits for it.
    pub min_transfer_rate: u64,
    /// Bytes of a request's headers.
    pub most_header_bytes: usize,
    /// How long the headers of a request may take to arrive.
    pub header_timeout: Duration,
    /// Whether HTTP/2 is spoken with those who begin with it, without TLS.
    pub http2: bool,
    /// How long answers may take to be sent once the server was told to stop.
    pub close_timeout: Duration,
}

/// Serves a router on a listener until it is told to stop.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    router: Router,
    reserved: Router,
    settings: ServerSettings,
}

/// How long the headers of a request may take on a connection for probes: there are few of those.
const RESERVED_HEADER_TIMEOUT: Duration = Duration::from_secs(2);

impl Server {
    /// A server that does not run yet. `reserved` answers where there is no place for more connections.
    #[must_use]
    pub const fn new(listener: TcpListener, router: Router, reserved: Router, settings: ServerSettings) -> Self {
        Self { listener, router, reserved, settings }
    }

    /// Serves until `stop`; then accepts nothing more, lets answers that are being made go out, and returns.
    pub async fn run(self, stop: CancellationToken) {
        let places = Places::new(self.settings.most_connections, self.settings.most_peer_connections);
        let graceful = GracefulShutdown::new();
        loop {
            let accepted = tokio::select! {
                () = stop.cancelled() => break,
                accepted = self.listener.accept() => accepted,
            };
            match accepted {
                Ok((stream, peer)) => match places.take(peer.ip()) {
                    Some(place) => self.serve(stream, place, &graceful),
                    None => turn_away(stream),
                },
                Err(error) => {
                    // Out of file descriptors, most likely; accepting again at once would only spin.
                    tracing::warn!(%error, "a connection could not be accepted");
                    tokio::time::sleep(Duration::from_millis(50)).await;
                }
            }
        }
        drop(self.listener);
        if tokio::time::timeout(self.settings.close_timeout, graceful.shutdown()).await.is_err() {
            tracing::warn!("connections were cut because they did not end in time");
        }
    }

    fn serve(&self, stream: TcpStream, place: Place, graceful: &GracefulShutdown) {
        // Small answers go out at once. A socket that cannot do that still works.
        let _ = stream.set_nodelay(true);
        let ServerSettings { header_timeout, answer_idle_timeout, min_transfer_rate, .. } = self.settings;
        let (router, header_timeout) = match place.is_reserved {
            true => (&self.reserved, header_timeout.min(RESERVED_HEADER_TIMEOUT)),
            false => (&self.router, header_timeout),
        };
        let mut builder = http1::Builder::new();
        builder
            .timer(TokioTimer::new())
            .keep_alive(!place.is_reserved)
            .header_read_timeout(header_timeout)
            .max_header_size(self.settings.most_header_bytes);
        let service = TowerToHyperService::new(router.clone());
        let pace = Pace::new(answer_idle_timeout, min_transfer_rate);
        let (watcher, settings) = (graceful.watcher(), self.settings);
        tokio::spawn(async move {
            let _place = place;
            let speaks_http2 = settings.http2 && begins_http2(&stream, header_timeout).await;
            let stream = TokioIo::new(ReadBackConnection::new(stream, pace));
            let ended = if speaks_http2 {
                watcher.watch(http2_builder(&settings).serve_connection(stream, service)).await
            } else {
                watcher.watch(builder.serve_connection(stream, service)).await
            };
            if let Err(error) = ended {
                tracing::debug!(%error, "a connection ended early");
            }
        });
    }
}

/// What HTTP/2 connections may do.
fn http2_builder(settings: &ServerSettings) -> http2::Builder<TokioExecutor> {
    /// Requests at a time on one connection; a principal's own limit holds besides.
    const MAX_STREAMS: u32 = 64;
    /// Streams that were reset before anybody looked at them; more ends the connection.
    const MAX_RESETS: usize = 20;
    /// How often it is asked whether the other side is still there.
    const ASK: Duration = Duration::from_secs(20);
    let mut builder = http2::Builder::new(TokioExecutor::new());
    builder
        .timer(TokioTimer::new())
        .max_concurrent_streams(MAX_STREAMS)
        .max_pending_accept_reset_streams(MAX_RESETS)
        .max_header_list_size(u32::try_from(settings.most_header_bytes).unwrap_or(u32::MAX))
        .keep_alive_interval(ASK)
        .keep_alive_timeout(settings.header_timeout);
    builder
}

/// Whether the other side begins with what HTTP/2 begins with, which no request of HTTP/1 does. Nothing is taken from the connection.
async fn begins_http2(stream: &TcpStream, longest: Duration) -> bool {
    const BEGIN: &[u8] = b"PRI * HTTP/2.0";
    const LOOK_AGAIN: Duration = Duration::from_millis(5);
    let look = async {
        let mut seen = [0; BEGIN.len()];
        loop {
            match stream.peek(&mut seen).await {
                Ok(0) | Err(_) => return false,
                Ok(count) if !BEGIN.starts_with(&seen[..count]) => return false,
                Ok(count) if count == BEGIN.len() => return true,
                // The rest of it is on its way.
                Ok(_) => tokio::time::sleep(LOOK_AGAIN).await,
            }
        }
    };
    tokio::time::timeout(longest, look).await.unwrap_or(false)
}

/// Says that there is no place, as far as that can be said without waiting.
fn turn_away(stream: TcpStream) {
    const ANSWER: &[u8] =
        b"HTTP/1.1 503 Service Unavailable\r\nretry-after: 1\r\nconnection: close\r\ncontent-length: 0\r\n\r\n";
    Metric::AdmissionRejected.count([("reason", "too_many_connections".to_owned())], 1);
    // Whoever does not hear it sees that the connection is closed.
    let _ = stream.try_write(ANSWER);
}
