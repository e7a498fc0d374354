//! The composition root: the only place where all parts of the service meet.

use std::{net::SocketAddr, sync::Arc, time::Duration};

use anyhow::Context as _;
use tokio::{net::TcpListener, sync::Semaphore, task::JoinHandle};
use tokio_util::sync::CancellationToken;

use crate::{
    config::{Isolation, Settings},
    engine::{MAX_MODEL_BYTES, tried_pose_model},
    http::{self, ApiState, HeavyRequests, Server, ServerSettings, Shares, Turns},
    identity::Tokens,
    jobs::{
        Assets, BuiltInAsset, Engine, Jobs, Keys, Library, ProcessEngine, RetargetEngine, Sweeper, WebhookDispatcher,
        Webhooks, Workers,
    },
    model::Control,
    outbound::Outbound,
    retarget,
    samples::Sample,
    store::{BlobPlace, Blobs, DataFolder, Records, Store},
    telemetry::{self, Clock, Metrics},
};

/// The samples, which every caller has; the API's examples name them by their numbers.
static BUILT_IN_ASSETS: [BuiltInAsset; 3] = [built_in(1), built_in(2), built_in(3)];

const fn built_in(number: u8) -> BuiltInAsset {
    let Sample { name, make, .. } = Sample::ALL[number as usize - 1];
    BuiltInAsset { number, file_name: name, bytes: make }
}

/// A service that runs.
#[derive(Debug)]
pub struct Running {
    address: SocketAddr,
    probes_address: Option<SocketAddr>,
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

    /// Where probes are answered besides, as a URL without a slash at the end.
    #[must_use]
    pub fn probes_url(&self) -> Option<String> {
        self.probes_address.map(|address| format!("http://{address}"))
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
/// As [`start_with`].
pub async fn start(settings: Settings) -> anyhow::Result<Running> {
    let engine = engine(&settings)?;
    start_with(settings, engine, Clock::system()).await
}

/// Starts the service with a given engine and clock.
///
/// # Errors
/// When the data folder is not there to be used, the database or the blob store does not answer, the file with the keys of a token
/// issuer cannot be used, or the address is taken.
pub async fn start_with(settings: Settings, engine: Arc<dyn Engine>, clock: Clock) -> anyhow::Result<Running> {
    let (settings, metrics) = (Arc::new(settings), Metrics::start().context("the metrics could not be started")?);
    telemetry::start_traces(&settings.otlp_endpoint.0, "serve")?;
    let tokens = Tokens::start(&settings, clock.clone()).await?;
    let core = Core::open(&settings, engine, clock).await?;
    let jobs = core.jobs.clone();
    let (listener, address) = listen(settings.listen, "--listen").await?;
    let (probes, probes_address) = core.probes(&settings, tokens.clone(), metrics.clone()).await?.unzip();
    let reserved = http::reserved_router(jobs.clone(), tokens.clone(), metrics.clone());
    let state = ApiState {
        assets: Assets::new(&jobs, core.outbound.clone()),
        library: Library::new(&jobs),
        webhooks: Webhooks::new(&jobs, core.outbound.clone()),
        keys: core.keys.clone(),
        tokens,
        jobs,
        settings: Arc::clone(&settings),
        metrics,
        spec_schema: retarget::spec_schema,
        shares: Shares::new(settings.max_principal_requests),
        turns: Turns::default(),
        heavy: HeavyRequests::start().context("the thread for large documents could not be started")?,
        requests: Arc::new(Semaphore::new(permits(settings.max_concurrent_requests))),
    };
    let server = Server::new(listener, http::router(state), reserved, server_settings(&settings));
    tracing::info!(%address, version = env!("CARGO_PKG_VERSION"), "started");
    let stop = CancellationToken::new();
    let task = tokio::spawn(core.run(Some(server), probes, stop.clone(), settings));
    Ok(Running { address, probes_address, stop, task })
}

async fn listen(address: SocketAddr, flag: &str) -> anyhow::Result<(TcpListener, SocketAddr)> {
    let listener = TcpListener::bind(address)
        .await
        .with_context(|| format!("cannot listen on {address}; is something else there? {flag} chooses another"))?;
    let address = listener.local_addr()?;
    Ok((listener, address))
}

/// Runs jobs that other processes take on, until `stop` is canceled: workers without an API. `started` hears where probes are
/// answered, if anywhere.
///
/// # Errors
/// When no other process could put jobs there, or the database or the blob store does not answer.
pub async fn work(
    settings: Settings,
    stop: CancellationToken,
    started: impl FnOnce(Option<SocketAddr>),
) -> anyhow::Result<()> {
    anyhow::ensure!(
        !settings.database.0.is_empty() && !settings.blobs.is_empty(),
        "a worker shares its jobs with other processes: give --database postgres://… and --blobs s3://… (or file:///…), \
         the same as to 'retargetd serve'"
    );
    let (settings, metrics) = (Arc::new(settings), Metrics::start().context("the metrics could not be started")?);
    telemetry::start_traces(&settings.otlp_endpoint.0, "worker")?;
    let core = Core::open(&settings, engine(&settings)?, Clock::system()).await?;
    let (probes, address) = core.probes(&settings, Tokens::none(), metrics).await?.unzip();
    tracing::info!(workers = settings.workers.0, version = env!("CARGO_PKG_VERSION"), "started");
    started(address);
    core.run(None, probes, stop, settings).await;
    Ok(())
}

/// The real engine, where the settings want it to work.
fn engine(settings: &Settings) -> anyhow::Result<Arc<dyn Engine>> {
    Ok(match settings.isolation {
        Isolation::Process => Arc::new(ProcessEngine::new(settings).context("the program cannot find itself")?),
        Isolation::Thread | Isolation::Inline => Arc::new(RetargetEngine),
    })
}

/// The keys of a service that may be running: they lie in its database.
///
/// # Errors
/// When the database cannot be opened.
pub async fn keys(settings: &Settings) -> anyhow::Result<Keys> {
    // Not taken: the database has any number of writers, and it is the files beside it that have one.
    let records = match settings.database.0.is_empty() {
        true => {
            let file = DataFolder::database_in(&settings.data);
            anyhow::ensure!(
                file.exists(),
                "there is no database at {}: no service has been started there",
                file.display()
            );
            Records::open(&file).await?
        }
        false => Records::connect(&settings.database.0, 2).await.context("the database cannot be used")?,
    };
    Ok(Keys::new(records, Clock::system()))
}

/// Makes the data folder and its database where they are not there yet.
///
/// # Errors
/// When they cannot be made.
pub async fn make_database(settings: &Settings) -> anyhow::Result<()> {
    let folder = &settings.data;
    std::fs::create_dir_all(folder).with_context(|| format!("the folder '{}' cannot be made", folder.display()))?;
    Records::open(&DataFolder::database_in(folder)).await?.close().await;
    Ok(())
}

/// What every role has: the store, and jobs over it.
struct Core {
    store: Arc<Store>,
    jobs: Jobs,
    keys: Keys,
    outbound: Outbound,
    /// Held until everything else is at rest: whoever takes the folder next finds it so.
    folder: Option<DataFolder>,
}

impl Core {
    async fn open(settings: &Arc<Settings>, engine: Arc<dyn Engine>, clock: Clock) -> anyhow::Result<Self> {
        let uses_folder = settings.database.0.is_empty() || settings.blobs.is_empty();
        let folder = if uses_folder { Some(DataFolder::take(&settings.data)?) } else { None };
        let records = records(settings, folder.as_ref()).await?;
        let blobs = match &folder {
            Some(folder) if settings.blobs.is_empty() => Blobs::local(folder.root())?,
            _ => Blobs::at(&BlobPlace::parse(&settings.blobs)?).context("the blob store cannot be used")?,
        };
        let store = Arc::new(Store::new(records, blobs.leaving_free(settings.reserved_disk.0)));
        if let Err(error) = store.blobs().check_room() {
            tracing::warn!(%error, "the reserve of the disk is reached: no files are taken until there is room");
        }
        let keys = Keys::new(store.records().clone(), clock.clone());
        let outbound = Outbound::new(settings, clock.clone());
        let jobs = Jobs::new(Arc::clone(&store), engine, Arc::clone(settings), clock, &BUILT_IN_ASSETS);
        if !settings.pose_model.is_empty() {
            jobs.use_pose_model(pose_model(&settings.pose_model)?.into());
        }
        let waiting = jobs.recover().await?;
        tracing::info!(waiting, "the queue is there");
        Ok(Self { store, jobs, keys, outbound, folder })
    }

    /// The server of probes and where it listens, where one is asked for.
    async fn probes(
        &self,
        settings: &Settings,
        tokens: Tokens,
        metrics: Metrics,
    ) -> anyhow::Result<Option<(Server, SocketAddr)>> {
        let Some(address) = settings.probes_listen else { return Ok(None) };
        let (listener, address) = listen(address, "--probes-listen").await?;
        let reserved = http::reserved_router(self.jobs.clone(), tokens.clone(), metrics.clone());
        let router = http::probes_router(self.jobs.clone(), tokens, metrics);
        Ok(Some((Server::new(listener, router, reserved, server_settings(settings)), address)))
    }

    async fn run(
        self,
        server: Option<Server>,
        probes: Option<Server>,
        stop: CancellationToken,
        settings: Arc<Settings>,
    ) {
        let parts = Parts {
            workers: Workers::start(&self.jobs, settings.workers.0),
            sweeper: Sweeper::start(&self.jobs),
            courier: WebhookDispatcher::start(&self.jobs, self.outbound),
            jobs: self.jobs,
            server,
            probes,
        };
        parts.run(stop, &settings).await;
        self.store.records().close().await;
        telemetry::stop_traces().await;
        drop(self.folder);
        tracing::info!("stopped");
    }
}

struct Parts {
    jobs: Jobs,
    workers: Workers,
    sweeper: Sweeper,
    courier: WebhookDispatcher,
    server: Option<Server>,
    probes: Option<Server>,
}

impl Parts {
    async fn run(self, stop: CancellationToken, settings: &Settings) {
        let close = CancellationToken::new();
        let close_probes = CancellationToken::new();
        let server = self.server.map(|server| tokio::spawn(server.run(close.clone())));
        let probes = self.probes.map(|probes| tokio::spawn(probes.run(close_probes.clone())));
        stop.cancelled().await;
        // Readiness goes first; load balancers need the delay to notice.
        self.jobs.drain();
        if server.is_some() {
            tokio::time::sleep(settings.drain_delay.0).await;
        }
        close.cancel();
        self.workers.stop(settings.grace_period.0).await;
        self.sweeper.stop().await;
        self.courier.stop().await;
        // Whoever watches sees the last jobs end.
        close_probes.cancel();
        for server in [server, probes].into_iter().flatten() {
            if let Err(error) = server.await {
                tracing::error!(%error, "a server ended with a fault");
            }
        }
    }
}

fn server_settings(settings: &Settings) -> ServerSettings {
    ServerSettings {
        most_connections: permits(settings.max_connections),
        most_peer_connections: permits(settings.max_peer_connections),
        answer_idle_timeout: settings.answer_idle_timeout.0,
        min_transfer_rate: settings.min_transfer_rate.0,
        most_header_bytes: usize::try_from(settings.max_header_bytes.0).unwrap_or(usize::MAX),
        header_timeout: settings.header_timeout.0,
        http2: settings.http2.0,
        close_timeout: settings.grace_period.0 + Duration::from_secs(1),
    }
}

fn permits(count: u64) -> usize {
    usize::try_from(count).unwrap_or(Semaphore::MAX_PERMITS).min(Semaphore::MAX_PERMITS)
}

/// The bytes of a pose model that was tried out.
fn pose_model(file: &str) -> anyhow::Result<Vec<u8>> {
    let place = || format!("the pose model {file} cannot be used");
    let size = std::fs::metadata(file).with_context(place)?.len();
    anyhow::ensure!(size <= MAX_MODEL_BYTES as u64, "{}: it has {size} bytes; {MAX_MODEL_BYTES} are the most", place());
    let bytes = std::fs::read(file).with_context(place)?;
    let tried = tried_pose_model(bytes.clone(), &Control::with_clock(telemetry::monotonic_seconds));
    tried.map_err(|failure| anyhow::anyhow!("{}: {}; {}", place(), failure.detail, failure.hint))?;
    Ok(bytes)
}

/// The records of the database that the settings name, else of the data folder.
async fn records(settings: &Settings, folder: Option<&DataFolder>) -> anyhow::Result<Records> {
    match folder {
        Some(folder) if settings.database.0.is_empty() => Ok(Records::open(&folder.database()).await?),
        _ => {
            let connections = u32::try_from(settings.database_connections).unwrap_or(u32::MAX);
            Records::connect(&settings.database.0, connections).await.context("the database cannot be used")
        }
    }
}
