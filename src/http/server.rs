//! Connections: how many, how long their headers may take, and how they end.

use std::{sync::Arc, time::Duration};

use axum::Router;
use hyper::server::conn::http1;
use hyper_util::{
    rt::{TokioIo, TokioTimer},
    server::graceful::GracefulShutdown,
    service::TowerToHyperService,
};
use tokio::{
    net::{TcpListener, TcpStream},
    sync::Semaphore,
};
use tokio_util::sync::CancellationToken;

/// What bounds connections.
#[derive(Clone, Copy, Debug)]
pub struct ServerSettings {
    /// Open connections. More wait to be accepted.
    pub most_connections: usize,
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
    settings: ServerSettings,
}

impl Server {
    /// A server that does not run yet.
    #[must_use]
    pub const fn new(listener: TcpListener, router: Router, settings: ServerSettings) -> Self {
        Self { listener, router, settings }
    }

    /// Serves until `stop`; then accepts nothing more, lets answers that are being made go out, and returns.
    pub async fn run(self, stop: CancellationToken) {
        let connections = Arc::new(Semaphore::new(self.settings.most_connections));
        let graceful = GracefulShutdown::new();
        loop {
            let accepted = async {
                let permit = Arc::clone(&connections).acquire_owned().await;
                (self.listener.accept().await, permit)
            };
            let (accepted, permit) = tokio::select! {
                () = stop.cancelled() => break,
                accepted = accepted => accepted,
            };
            match accepted {
                Ok((stream, _)) => self.serve(stream, permit, &graceful),
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

    fn serve(&self, stream: TcpStream, permit: impl Send + 'static, graceful: &GracefulShutdown) {
        // Small answers go out at once. A socket that cannot do that still works.
        let _ = stream.set_nodelay(true);
        let mut builder = http1::Builder::new();
        builder
            .timer(TokioTimer::new())
            .header_read_timeout(self.settings.header_timeout)
            .max_header_size(self.settings.most_header_bytes);
        let service = TowerToHyperService::new(self.router.clone());
        let connection = graceful.watch(builder.serve_connection(TokioIo::new(stream), service));
        tokio::spawn(async move {
            let _permit = permit;
            if let Err(error) = connection.await {
                tracing::debug!(%error, "a connection ended early");
            }
        });
    }
}
