//! The composition root: the only place where all parts of the service meet.

use std::{net::SocketAddr, sync::Arc, time::Duration};

use anyhow::Context as _;
use tokio::{net::TcpListener, sync::Semaphore, task::JoinHandle};
use tokio_util::sync::CancellationToken;

use crate::{
    config::Settings,
    http::{self, ApiState, Server, ServerSettings},
    jobs::{Assets, Engine, Jobs, Library, RetargetEngine, Sweeper, Workers},
    rig,
    store::{DataFolder, Store},
    telemetry::{Clock, Metrics},
};

/// A service that runs.
#[derive(Debug)]
pub struct Running {
    address: SocketAddr,
    stop: CancellationToken,
    task: JoinHandle<()>,
}

impl Running {
    /// Where it listens. With port 0 in the settings, this has the port that was taken.
    #[must_use]
    pub const fn address(&self) -> SocketAddr {
        self.address
    }

    /// Where it listens, as a URL without a slash at the end.
    #[must_use]
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Tells it to stop and waits until it has: nothing new is taken, running jobs get their grace period, the rest waits for
    /// the next start.
    ///
    /// # Errors
    /// When it failed on the way.
    pub async fn stop(self) -> anyhow::Result<()> {
        self.stop.cancel();
        self.task.await.context("the service failed while stopping")
    }
}

/// Starts the service with the real engine.
///
/// # Errors
/// When the data folder is not there to be used, or the address is taken.
pub async fn start(settings: Settings) -> anyhow::Result<Running> {
    start_with(settings, Arc::new(RetargetEngine), Clock::system()).await
}

/// Starts the service with a given engine and clock.
///
/// # Errors
/// When the data folder is not there to be used, or the address is taken.
pub async fn start_with(settings: Settings, engine: Arc<dyn Engine>, clock: Clock) -> anyhow::Result<Running> {
    let folder = DataFolder::take(&settings.data)?;
    let store = Arc::new(Store::open(&folder).await?);
    let metrics = Metrics::start().context("the metrics could not be started")?;
    let settings = Arc::new(settings);
    let jobs = Jobs::new(Arc::clone(&store), engine, Arc::clone(&settings), clock);
    let taken_up = jobs.recover().await?;
    let listener = TcpListener::bind(settings.listen).await.with_context(|| {
        format!("cannot listen on {}; is something else there? --listen chooses another", settings.listen)
    })?;
    let address = listener.local_addr()?;
    let state = ApiState {
        jobs: jobs.clone(),
        assets: Assets::new(&jobs),
        library: Library::new(&jobs),
        settings: Arc::clone(&settings),
        metrics,
        spec_schema: rig::spec_schema,
        requests: Arc::new(Semaphore::new(permits(settings.max_concurrent_requests))),
    };
    let server = Server::new(listener, http::router(state), server_settings(&settings));
    let parts = Parts {
        workers: Workers::start(&jobs, settings.workers.0.get()),
        sweeper: Sweeper::start(&jobs),
        jobs,
        server,
    };
    tracing::info!(%address, version = env!("CARGO_PKG_VERSION"), taken_up, "started");
    let stop = CancellationToken::new();
    let stopped = stop.clone();
    let task = tokio::spawn(async move {
        parts.run(stopped, &settings).await;
        store.records().close().await;
        // The lock goes last: whoever takes the folder next finds it at rest.
        drop(folder);
        tracing::info!("stopped");
    });
    Ok(Running { address, stop, task })
}

struct Parts {
    jobs: Jobs,
    workers: Workers,
    sweeper: Sweeper,
    server: Server,
}

impl Parts {
    async fn run(self, stop: CancellationToken, settings: &Settings) {
        let close = CancellationToken::new();
        let server = tokio::spawn(self.server.run(close.clone()));
        stop.cancelled().await;
        // Readiness goes first; load balancers need the delay to notice.
        self.jobs.drain();
        tokio::time::sleep(settings.drain_delay.0).await;
        close.cancel();
        self.workers.stop(settings.grace_period.0).await;
        self.sweeper.stop().await;
        if let Err(error) = server.await {
            tracing::error!(%error, "the server ended with a fault");
        }
    }
}

fn server_settings(settings: &Settings) -> ServerSettings {
    ServerSettings {
        most_connections: permits(settings.max_connections),
        most_header_bytes: usize::try_from(settings.max_header_bytes.0).unwrap_or(usize::MAX),
        header_timeout: settings.header_timeout.0,
        close_timeout: settings.grace_period.0 + Duration::from_secs(1),
    }
}

fn permits(count: u64) -> usize {
    usize::try_from(count).unwrap_or(Semaphore::MAX_PERMITS).min(Semaphore::MAX_PERMITS)
}
