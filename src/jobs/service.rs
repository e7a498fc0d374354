//! What the rest of the program can ask of jobs.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use tokio::{sync::broadcast, time::Instant};

use super::{
    Engine, JobEvent, Refusal, next_state,
    queue::Queue,
    running::{RunningJobs, StopReason},
};
use crate::{
    config::Settings,
    engine::{self, Format, Limits, NamedBytes, Progress},
    store::{
        AssetId, ConfigDocument, FinishedJob, InputRole, JobFailure, JobId, JobInput, JobRecord, JobRequest, JobState,
        Page, ResultId, ResultRecord, Store, VersionedName,
    },
    telemetry::{Clock, Metric},
};

/// What somebody wants done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewJob {
    /// The files. Source and target must be among them.
    pub inputs: BTreeMap<InputRole, AssetId>,
    /// The retarget config.
    pub config: Option<ConfigDocument>,
    /// The formats wanted. Empty: what the config says.
    pub formats: Vec<Format>,
    /// The user's own words about it.
    pub labels: BTreeMap<String, String>,
    /// The preset that the config is laid over.
    pub preset: Option<String>,
}

/// A job as it is now: its record, and what only this process knows.
#[derive(Clone, Debug)]
pub struct JobSnapshot {
    /// The record.
    pub record: JobRecord,
    /// The files it gave.
    pub results: Vec<ResultRecord>,
    /// Its place in the queue, from 1.
    pub queue_position: Option<u64>,
    /// How far it is, while it runs.
    pub progress: Option<Progress>,
}

/// The jobs. Cheap to clone; all clones are the same.
#[derive(Clone)]
pub struct Jobs(pub(super) Arc<Inner>);

pub(super) struct Inner {
    pub(super) store: Arc<Store>,
    pub(super) engine: Arc<dyn Engine>,
    pub(super) settings: Arc<Settings>,
    pub(super) limits: Limits,
    pub(super) clock: Clock,
    pub(super) queue: Arc<Queue>,
    pub(super) running: Arc<RunningJobs>,
    changes: broadcast::Sender<JobId>,
    is_draining: AtomicBool,
}

impl std::fmt::Debug for Jobs {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Jobs").field("queued", &self.queued()).field("running", &self.running()).finish()
    }
}

/// The limits that files are read under, from the settings that set them.
#[must_use]
pub(super) fn engine_limits(settings: &Settings) -> Limits {
    Limits {
        file_bytes: settings.max_file_bytes.0,
        decoded_bytes: settings.max_decoded_bytes.0,
        decompression_ratio: settings.max_decompression_ratio,
        json_depth: settings.max_json_depth,
        nodes: settings.max_nodes,
        hierarchy_depth: settings.max_hierarchy_depth,
        clips: settings.max_clips,
        frames_per_clip: settings.max_frames_per_clip,
        samples: settings.max_samples,
    }
}

impl Jobs {
    /// Jobs over a store, run by `engine`. Nothing runs before [`super::Workers`] are started.
    #[must_use]
    pub fn new(store: Arc<Store>, engine: Arc<dyn Engine>, settings: Arc<Settings>, clock: Clock) -> Self {
        /// Waiters that fall this far behind look the record up instead of missing a change.
        const CHANGES_KEPT: usize = 1024;
        let queue = Arc::new(Queue::new(settings.max_queued_jobs, settings.max_queued_bytes.0));
        Self(Arc::new(Inner {
            limits: engine_limits(&settings),
            store,
            engine,
            settings,
            clock,
            queue,
            running: Arc::default(),
            changes: broadcast::Sender::new(CHANGES_KEPT),
            is_draining: AtomicBool::new(false),
        }))
    }

    /// Whether a new job would be taken now; to be asked before a large body is read.
    ///
    /// # Errors
    /// [`Refusal::Draining`] or [`Refusal::QueueFull`].
    pub fn check_admission(&self) -> Result<(), Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        self.0.queue.check_room()
    }

    /// Takes a job on. When this returns, the job survives a crash.
    ///
    /// # Errors
    /// When the queue is full, the service is going down, or an input is not there.
    pub async fn submit(&self, new: NewJob) -> Result<JobSnapshot, Refusal> {
        let (request, input_bytes) = self.resolve(new).await?;
        self.enqueue(request, input_bytes, None).await
    }

    pub(super) async fn resolve(&self, new: NewJob) -> Result<(JobRequest, u64), Refusal> {
        let (mut found, mut input_bytes) = (BTreeMap::new(), 0);
        for (role, id) in new.inputs {
            let Some(asset) = self.0.store.records().asset(&id).await? else {
                return Err(Refusal::UnknownInput { role, id: id.to_string() });
            };
            input_bytes += asset.bytes;
            found.insert(role, JobInput { asset: id, sha256: asset.sha256, file_name: asset.file_name });
        }
        let missing = |role: InputRole| Refusal::UnknownInput { role, id: String::new() };
        let (config, preset) = self.lay_over_preset(new.config, new.preset).await?;
        let request = JobRequest {
            source: found.remove(&InputRole::Source).ok_or_else(|| missing(InputRole::Source))?,
            target: found.remove(&InputRole::Target).ok_or_else(|| missing(InputRole::Target))?,
            source_rest: found.remove(&InputRole::SourceRest),
            target_rest: found.remove(&InputRole::TargetRest),
            config,
            formats: new.formats.into_iter().map(|format| format.info().name.to_owned()).collect(),
            labels: new.labels,
            preset,
            rigs: self.own_rigs().await?.versions(),
        };
        Ok((request, input_bytes))
    }

    /// The config with the preset under it. What comes out is the job's own: it does not change when the preset does.
    async fn lay_over_preset(
        &self,
        config: Option<ConfigDocument>,
        preset: Option<String>,
    ) -> Result<(Option<ConfigDocument>, Option<VersionedName>), Refusal> {
        let Some(name) = preset else { return Ok((config, None)) };
        let kept = self.preset(&name).await?;
        let bytes = config.as_ref().map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() });
        let text = engine::merge_config(&kept.document, bytes)?;
        let version = kept.own.map_or(0, |(version, _)| version);
        let config = ConfigDocument { file_name: "config.json".to_owned(), text };
        Ok((Some(config), Some(VersionedName { name, version })))
    }

    async fn enqueue(
        &self,
        request: JobRequest,
        input_bytes: u64,
        retry_of: Option<JobId>,
    ) -> Result<JobSnapshot, Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        let reservation = self.0.queue.reserve(input_bytes)?;
        let record = JobRecord {
            id: JobId::new(),
            state: JobState::Queued,
            request,
            input_bytes,
            attempt: 0,
            retry_of,
            created_at: self.0.clock.now(),
            started_at: None,
            finished_at: None,
            expires_at: None,
            warnings: 0,
            failure: None,
        };
        if !self.0.store.records().add_job(&record).await? {
            let (role, input) = self.first_missing(&record.request).await?;
            return Err(Refusal::UnknownInput { role, id: input.asset.to_string() });
        }
        reservation.fill(record.id.clone());
        Metric::JobsSubmitted.count([], 1);
        let queue_position = self.0.queue.position(&record.id);
        Ok(JobSnapshot { record, results: Vec::new(), queue_position, progress: None })
    }

    async fn first_missing<'a>(&self, request: &'a JobRequest) -> Result<(InputRole, &'a JobInput), Refusal> {
        for (role, input) in request.inputs() {
            if self.0.store.records().asset(&input.asset).await?.is_none() {
                return Ok((role, input));
            }
        }
        Ok((InputRole::Source, &request.source))
    }

    /// A job as it is now.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn get(&self, id: &JobId) -> Result<JobSnapshot, Refusal> {
        let record = self.record(id).await?;
        let results = match record.state {
            JobState::Succeeded => self.0.store.records().job_results(id).await?,
            _ => Vec::new(),
        };
        Ok(self.snapshot(record, results))
    }

    fn snapshot(&self, record: JobRecord, results: Vec<ResultRecord>) -> JobSnapshot {
        let queue_position = self.0.queue.position(&record.id);
        let progress = self.0.running.progress(&record.id);
        JobSnapshot { record, results, queue_position, progress }
    }

    async fn record(&self, id: &JobId) -> Result<JobRecord, Refusal> {
        let record = self.0.store.records().job(id).await?;
        record.ok_or_else(|| Refusal::NotFound { kind: "job", id: id.to_string() })
    }

    /// Up to `most` jobs, newest first, that are older than `before` and in `state`.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(
        &self,
        state: Option<JobState>,
        before: Option<&JobId>,
        most: usize,
    ) -> Result<Page<JobSnapshot>, Refusal> {
        let page = self.0.store.records().jobs(state, before, most).await?;
        let mut items = Vec::with_capacity(page.items.len());
        for record in page.items {
            let results = match record.state {
                JobState::Succeeded => self.0.store.records().job_results(&record.id).await?,
                _ => Vec::new(),
            };
            items.push(self.snapshot(record, results));
        }
        Ok(Page { items, has_more: page.has_more })
    }

    /// The job when it has ended, or as it is when `longest` is over or the service is going down.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn wait(&self, id: &JobId, longest: Duration) -> Result<JobSnapshot, Refusal> {
        // Listening begins before looking, so that no change is missed in between.
        let mut changes = self.0.changes.subscribe();
        let deadline = Instant::now() + longest;
        loop {
            let snapshot = self.get(id).await?;
            if snapshot.record.state.is_final() || self.is_draining() {
                return Ok(snapshot);
            }
            let changed = async {
                // Falling behind may have hidden the change, so it counts as one.
                while matches!(changes.recv().await, Ok(other) if other != *id && !self.is_draining()) {}
            };
            if tokio::time::timeout_at(deadline, changed).await.is_err() {
                return self.get(id).await;
            }
        }
    }

    /// Stops a job. What has ended already stays as it is. Never refused for load.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn cancel(&self, id: &JobId) -> Result<JobSnapshot, Refusal> {
        loop {
            let record = self.record(id).await?;
            let Some(next) = next_state(record.state, JobEvent::RequestCancel) else { return self.get(id).await };
            let moved = match next {
                JobState::Canceled => {
                    self.0.queue.remove(id);
                    self.finish(id, record.state, self.ending(JobState::Canceled, None)).await?
                }
                _ if record.state == next => true,
                _ => {
                    let change = (record.state, next);
                    self.0.store.records().move_job(id, change, record.attempt, record.started_at).await?
                }
            };
            // Where it did not move, a worker was faster, and the loop looks again.
            if moved {
                // The state comes first: a worker that stops looks there for what to write.
                self.0.running.stop(id, StopReason::Canceled);
                self.announce(id);
                return self.get(id).await;
            }
        }
    }

    /// Asks for the same again, as a new job.
    ///
    /// # Errors
    /// When the job has not ended, its files are gone, or a new job would not be taken.
    pub async fn retry(&self, id: &JobId) -> Result<JobSnapshot, Refusal> {
        let JobRecord { state, request, input_bytes, .. } = self.record(id).await?;
        if !state.is_final() {
            return Err(Refusal::WrongState { id: id.clone(), state, action: "retried" });
        }
        self.enqueue(request, input_bytes, Some(id.clone())).await
    }

    /// Removes a job that has ended, with its results.
    ///
    /// # Errors
    /// When there is none, or it has not ended.
    pub async fn delete(&self, id: &JobId) -> Result<(), Refusal> {
        match self.0.store.records().remove_job(id).await? {
            Some(digests) => Ok(self.0.store.remove_unnamed(&digests).await?),
            None => Err(Refusal::WrongState { id: id.clone(), state: self.record(id).await?.state, action: "deleted" }),
        }
    }

    /// The report of a job that succeeded, as JSON.
    ///
    /// # Errors
    /// When there is no such job, or it has no report.
    pub async fn report(&self, id: &JobId) -> Result<String, Refusal> {
        let report = self.0.store.records().job_report(id).await?;
        self.shown(id, report).await
    }

    /// The resolved spec of a job that succeeded, as JSON.
    ///
    /// # Errors
    /// When there is no such job, or it has none.
    pub async fn resolved_spec(&self, id: &JobId) -> Result<String, Refusal> {
        let spec = self.0.store.records().job_resolved_spec(id).await?;
        self.shown(id, spec).await
    }

    async fn shown(&self, id: &JobId, document: Option<String>) -> Result<String, Refusal> {
        match document {
            Some(document) => Ok(document),
            None => Err(Refusal::WrongState { id: id.clone(), state: self.record(id).await?.state, action: "shown" }),
        }
    }

    /// A result.
    ///
    /// # Errors
    /// When there is none, or its time is over.
    pub async fn result(&self, id: &ResultId) -> Result<ResultRecord, Refusal> {
        let result = self.0.store.records().result(id).await?;
        let result = result.ok_or_else(|| Refusal::NotFound { kind: "result", id: id.to_string() })?;
        if result.expires_at <= self.0.clock.now() {
            return Err(Refusal::Expired { kind: "result", id: id.to_string() });
        }
        Ok(result)
    }

    /// The bytes of a blob that a record names, or those of a range of it.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn content(
        &self,
        sha256: &str,
        range: Option<std::ops::Range<u64>>,
    ) -> Result<crate::store::ByteStream, Refusal> {
        Ok(self.0.store.blobs().stream(sha256, range).await?)
    }

    /// How many jobs wait.
    #[must_use]
    pub fn queued(&self) -> usize {
        self.0.queue.len()
    }

    /// How many jobs run.
    #[must_use]
    pub fn running(&self) -> usize {
        self.0.running.len()
    }

    /// Whether the service is going down.
    #[must_use]
    pub fn is_draining(&self) -> bool {
        self.0.is_draining.load(Ordering::SeqCst)
    }

    /// Takes no new jobs from now on, and lets those who wait go.
    pub fn drain(&self) {
        self.0.is_draining.store(true, Ordering::SeqCst);
        self.announce(&JobId::new());
    }

    /// Whether the store answers.
    ///
    /// # Errors
    /// When it does not.
    pub async fn check_store(&self) -> Result<(), Refusal> {
        Ok(self.0.store.records().check().await?)
    }

    /// Tells those who wait that something about the job has changed.
    pub(super) fn announce(&self, id: &JobId) {
        // Nobody waiting is no failure.
        let _ = self.0.changes.send(id.clone());
    }

    /// An end without results.
    pub(super) fn ending(&self, state: JobState, failure: Option<JobFailure>) -> FinishedJob {
        FinishedJob {
            state,
            finished_at: self.0.clock.now(),
            expires_at: self.0.clock.after(self.0.settings.job_retention.0),
            failure,
            report: None,
            resolved_spec: None,
            warnings: 0,
            results: Vec::new(),
        }
    }

    /// Writes the end of a job that is in state `from`, counts it, and tells those who wait. Gives `false` when the job is
    /// in another state.
    pub(super) async fn finish(&self, id: &JobId, from: JobState, end: FinishedJob) -> Result<bool, Refusal> {
        let done = self.0.store.records().finish_job(id, from, &end).await?;
        if done {
            let code = end.failure.as_ref().map_or_else(String::new, |failure| failure.code.clone());
            Metric::JobsFinished.count([("state", end.state.name().to_owned()), ("code", code.clone())], 1);
            Metric::LastJobFinished.set([], end.finished_at.as_millisecond() as f64 / 1e3);
            tracing::info!(job_id = %id, state = end.state.name(), code, "the job has ended");
            self.announce(id);
        }
        Ok(done)
    }
}
