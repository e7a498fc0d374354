//! Connections: how many, how long their headers may take, and how they end.

use std::time::Duration;

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
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
        let stream = ReadBackConnection::new(stream, Pace::new(answer_idle_timeout, min_transfer_rate));
        let connection = graceful.watch(builder.serve_connection(TokioIo::new(stream), service));
        tokio::spawn(async move {
            let _place = place;
            if let Err(error) = connection.await {
                tracing::debug!(%error, "a connection ended early");
            }
        });
    }
}

/// Says that there is no place, as far as that can be said without waiting.
fn turn_away(stream: TcpStream) {
    const ANSWER: &[u8] =
        b"HTTP/1.1 503 Service Unavailable\r\nretry-after: 1\r\nconnection: close\r\ncontent-length: 0\r\n\r\n";
    Metric::AdmissionRejected.count([("reason", "too_many_connections".to_owned())], 1);
    // Whoever does not hear it sees that the connection is closed.
    let _ = stream.try_write(ANSWER);
}
