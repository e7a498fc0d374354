//! What the rest of the program can ask of jobs.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use bytes::Bytes;
use tokio::{
    sync::{Notify, broadcast},
    time::Instant,
};

use super::{
    BuiltInAsset, Engine, JobEvent, Refusal,
    admission::Admission,
    changes::{Change, Changes},
    database_clock::DatabaseClock,
    failure,
    inspections::Inspections,
    kept_pictures::KeptPictures,
    looks::{Look, LookMeans, Looks},
    memory::MemoryBudget,
    next_state,
    one_shot::{Handovers, HeadStarts},
    picture_room::PictureRoom,
    record_room::RecordRoom,
    running::{RunningJobs, StopReason},
    stored_bytes::StoredBytes,
    streams::OpenStreams,
};
use crate::{
    config::{Failpoint, Settings},
    engine::{Control, Failure, Limits},
    store::{
        Ended, FinishedJob, JobFailure, JobFilter, JobId, JobRecord, JobState, LeaseId, OnError, Page, Principal,
        QueueDepth, ResultId, ResultRecord, Store, StoredProgress,
    },
    telemetry::{Clock, Metric},
};

/// A job as it is now: its record, and what only this process knows.
#[derive(Clone, Debug)]
pub struct JobSnapshot {
    /// The record.
    pub record: JobRecord,
    /// The files it gave.
    pub results: Vec<ResultRecord>,
    /// Its place among the waiting jobs of its principal, from 1; places after ten thousand are told as that. Not counted for lists.
    pub queue_position: Option<u64>,
    /// How far it is, while it runs.
    pub progress: Option<StoredProgress>,
}

/// Counting more jobs before one that waits is worth nobody's while.
const MAX_POSITION: u64 = 10_000;
/// How often to look at a job that somebody waits for, in case a notice of another process was missed.
const LOOK_AT_AWAITED: Duration = Duration::from_secs(2);

/// The jobs. Cheap to clone; all clones are the same.
#[derive(Clone)]
pub struct Jobs(pub(super) Arc<Inner>);

pub(super) struct Inner {
    pub(super) store: Arc<Store>,
    pub(super) engine: Arc<dyn Engine>,
    pub(super) settings: Arc<Settings>,
    pub(super) limits: Limits,
    pub(super) clock: Clock,
    pub(super) database_clock: DatabaseClock,
    pub(super) admission: Arc<Admission>,
    pub(super) memory: MemoryBudget,
    pub(super) inspections: Inspections,
    pub(super) picture_room: PictureRoom,
    /// The ONNX file of a pose model, where there is one.
    pub(super) pose_model: OnceLock<Bytes>,
    pub(super) pictures: KeptPictures,
    pub(super) looks: Looks,
    pub(super) built_in_assets: &'static [BuiltInAsset],
    pub(super) running: Arc<RunningJobs>,
    pub(super) streams: Arc<OpenStreams>,
    pub(super) changes: Changes,
    pub(super) handovers: Arc<Handovers>,
    pub(super) head_starts: Arc<HeadStarts>,
    pub(super) stored_bytes: StoredBytes,
    pub(super) record_room: RecordRoom,
    /// One who waits for something to tell webhooks: the task that does.
    pub(super) outbox: Notify,
    is_draining: AtomicBool,
}

impl std::fmt::Debug for Jobs {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Jobs").field("running", &self.running()).finish_non_exhaustive()
    }
}

/// The limits that files are read under, from the settings that set them.
#[must_use]
pub fn engine_limits(settings: &Settings) -> Limits {
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
    pub fn new(
        store: Arc<Store>,
        engine: Arc<dyn Engine>,
        settings: Arc<Settings>,
        clock: Clock,
        built_in_assets: &'static [BuiltInAsset],
    ) -> Self {
        let admission = Arc::new(Admission::new(QueueDepth {
            jobs: settings.max_queued_jobs,
            bytes: settings.max_queued_bytes.0,
            batch_jobs: settings.max_queued_batch_jobs,
        }));
        Self(Arc::new(Inner {
            limits: engine_limits(&settings),
            looks: Looks::new(settings.workers.0),
            memory: MemoryBudget::new(settings.memory_budget.0),
            store,
            engine,
            settings,
            clock,
            database_clock: DatabaseClock::default(),
            admission,
            built_in_assets,
            inspections: Inspections::default(),
            picture_room: PictureRoom::default(),
            pose_model: OnceLock::new(),
            pictures: KeptPictures::default(),
            running: Arc::default(),
            streams: Arc::default(),
            changes: Changes::default(),
            handovers: Arc::default(),
            head_starts: Arc::default(),
            stored_bytes: StoredBytes::default(),
            record_room: RecordRoom::default(),
            outbox: Notify::new(),
            is_draining: AtomicBool::new(false),
        }))
    }

    /// A job as it is now.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn get(&self, owner: &Principal, id: &JobId) -> Result<JobSnapshot, Refusal> {
        self.seen(self.record(owner, id).await?).await
    }

    /// A job whose record is known, with what else there is to see of it.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn seen(&self, record: JobRecord) -> Result<JobSnapshot, Refusal> {
        let results = match record.state {
            JobState::Succeeded => self.0.store.records().job_results(&record.id).await?,
            _ => Vec::new(),
        };
        let position = match record.state {
            JobState::Queued => Some(self.0.store.records().queue_position(&record, MAX_POSITION).await?),
            _ => None,
        };
        Ok(self.snapshot(record, results, position))
    }

    /// The places of those jobs of one owner that wait.
    async fn queue_positions(&self, records: &[JobRecord]) -> Result<BTreeMap<JobId, u64>, Refusal> {
        let waiting: Vec<&JobRecord> = records.iter().filter(|record| record.state == JobState::Queued).collect();
        let Some(first) = waiting.first() else { return Ok(BTreeMap::new()) };
        let ids: Vec<&JobId> = waiting.iter().map(|record| &record.id).collect();
        Ok(self.0.store.records().queue_positions(&first.principal, &ids, MAX_POSITION).await?)
    }

    /// What this process knows better than the record is put beside it.
    fn snapshot(&self, record: JobRecord, results: Vec<ResultRecord>, queue_position: Option<u64>) -> JobSnapshot {
        let progress = match record.state {
            JobState::Running => self.0.running.progress(&record.id).or_else(|| record.progress.clone()),
            _ => None,
        };
        JobSnapshot { record, results, queue_position, progress }
    }

    /// To who does not own a job, there is none.
    pub(super) async fn record(&self, owner: &Principal, id: &JobId) -> Result<JobRecord, Refusal> {
        self.0.handovers.settled(id).await;
        let record = self.0.store.records().job(id).await?.filter(|record| record.principal == *owner);
        record.ok_or_else(|| Refusal::NotFound { kind: "job", id: id.to_string() })
    }

    /// Up to `most` jobs of one owner that pass the filter, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn list(
        &self,
        owner: &Principal,
        filter: &JobFilter,
        before: Option<&JobId>,
        most: usize,
    ) -> Result<Page<JobSnapshot>, Refusal> {
        self.snapshots(self.0.store.records().jobs(owner, filter, before, most).await?).await
    }

    /// A page of jobs as they are now.
    pub(super) async fn snapshots(&self, page: Page<JobRecord>) -> Result<Page<JobSnapshot>, Refusal> {
        let succeeded = page.items.iter().filter(|record| record.state == JobState::Succeeded);
        let mut results =
            self.0.store.records().results_of(&succeeded.map(|record| &record.id).collect::<Vec<_>>()).await?;
        let mut positions = self.queue_positions(&page.items).await?;
        let mut items = Vec::with_capacity(page.items.len());
        for record in page.items {
            let (results, position) = (results.remove(&record.id).unwrap_or_default(), positions.remove(&record.id));
            items.push(self.snapshot(record, results, position));
        }
        Ok(Page { items, has_more: page.has_more })
    }

    /// The job when it has ended, or as it is when `longest` is over or the service is going down.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn wait(&self, owner: &Principal, id: &JobId, longest: Duration) -> Result<JobSnapshot, Refusal> {
        // Listening begins before looking, so that no change is missed in between.
        let changes = self.0.changes.subscribe();
        let record = self.record(owner, id).await?;
        if record.state.is_final() || self.is_draining() {
            return self.seen(record).await;
        }
        self.wait_with(changes, owner, id, longest).await
    }

    /// As [`Jobs::wait`], for a job that `changes` tells of from its beginning.
    pub(super) async fn wait_with(
        &self,
        mut changes: broadcast::Receiver<Change>,
        owner: &Principal,
        id: &JobId,
        longest: Duration,
    ) -> Result<JobSnapshot, Refusal> {
        let deadline = Instant::now() + longest;
        loop {
            let changed = async {
                // Falling behind may have hidden the end, so it counts as one.
                while matches!(changes.recv().await, Ok(change) if !change.may_end(id) && !self.is_draining()) {}
            };
            let look = deadline.min(Instant::now() + LOOK_AT_AWAITED);
            let is_over = tokio::time::timeout_at(look, changed).await.is_err() && look == deadline;
            let record = self.record(owner, id).await?;
            if is_over || record.state.is_final() || self.is_draining() {
                return self.seen(record).await;
            }
        }
    }

    /// Stops a job. What has ended already stays as it is. Never refused for load.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn cancel(&self, owner: &Principal, id: &JobId) -> Result<JobSnapshot, Refusal> {
        loop {
            let record = self.record(owner, id).await?;
            let Some(next) = next_state(record.state, JobEvent::RequestCancel) else {
                return self.get(owner, id).await;
            };
            let end = (next == JobState::Canceled).then(|| self.ending(next, None));
            let moved = match &end {
                Some(end) => self.finish(id, (record.state, None), end.clone()).await?,
                None if record.state == next => true,
                None => self.0.store.records().request_cancel(id).await?,
            };
            // Where it did not move, a worker was faster, and the loop looks again.
            if moved {
                // The state comes first: a worker that stops looks there for what to write.
                self.0.running.stop(id, StopReason::Canceled);
                self.0.changes.announce(id, next);
                return match end {
                    Some(end) => self.seen(record.ended_without_results(&end)).await,
                    None => self.get(owner, id).await,
                };
            }
        }
    }

    /// Asks for the same again, as a new job.
    ///
    /// # Errors
    /// When the job has not ended, its files are gone, or a new job would not be taken.
    pub async fn retry(&self, owner: &Principal, id: &JobId) -> Result<JobSnapshot, Refusal> {
        let record = self.record(owner, id).await?;
        if !record.state.is_final() {
            return Err(Refusal::WrongState { id: id.clone(), state: record.state, action: "it cannot be retried" });
        }
        self.seen(self.submit_again(record).await?.job).await
    }

    /// Removes a job that has ended, with its results.
    ///
    /// # Errors
    /// When there is none, or it has not ended.
    pub async fn delete(&self, owner: &Principal, id: &JobId) -> Result<(), Refusal> {
        let JobRecord { state, .. } = self.record(owner, id).await?;
        match self.0.store.records().remove_job(id).await? {
            Some(digests) => Ok(self.0.store.remove_unnamed(&digests).await?),
            None => Err(Refusal::WrongState { id: id.clone(), state, action: "it cannot be deleted" }),
        }
    }

    /// The report of a job that succeeded, as JSON.
    ///
    /// # Errors
    /// When there is no such job, or it has no report.
    pub async fn report(&self, owner: &Principal, id: &JobId) -> Result<String, Refusal> {
        self.0.handovers.settled(id).await;
        let report = self.0.store.records().job_report(owner, id).await?;
        self.shown(owner, id, report).await
    }

    /// The resolved spec of a job that succeeded, as JSON.
    ///
    /// # Errors
    /// When there is no such job, or it has none.
    pub async fn resolved_spec(&self, owner: &Principal, id: &JobId) -> Result<String, Refusal> {
        self.0.handovers.settled(id).await;
        let spec = self.0.store.records().job_resolved_spec(owner, id).await?;
        self.shown(owner, id, spec).await
    }

    /// A document of a job, which only a job has that has succeeded.
    async fn shown(&self, owner: &Principal, id: &JobId, document: Option<String>) -> Result<String, Refusal> {
        match document {
            Some(document) => Ok(document),
            None => {
                let JobRecord { id, state, .. } = self.record(owner, id).await?;
                let action = if state.is_final() {
                    "it has no report and no config"
                } else {
                    "it has no report and no config yet"
                };
                Err(Refusal::WrongState { id, state, action })
            }
        }
    }

    /// A result.
    ///
    /// # Errors
    /// When there is none, or its time is over.
    pub async fn result(&self, owner: &Principal, id: &ResultId) -> Result<ResultRecord, Refusal> {
        let result = self.0.store.records().result(owner, id).await?;
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

    /// A URL of the file store from which anybody who has it can get that blob for a while; `None` where downloads go through the
    /// service.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn download_link(&self, sha256: &str, content_disposition: &str) -> Result<Option<String>, Refusal> {
        let period = self.0.settings.download_link_period.0;
        if period.is_zero() {
            return Ok(None);
        }
        Ok(self.0.store.blobs().signed_url(sha256, content_disposition, period).await?)
    }

    /// How many jobs run in this process.
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
        self.0.changes.announce_anything();
    }

    /// Whether the store answers.
    ///
    /// # Errors
    /// When it does not.
    pub async fn check_store(&self) -> Result<(), Refusal> {
        self.0.store.blobs().check_room()?;
        Ok(self.0.store.records().check().await?)
    }

    /// Has the engine look at what `load` reads; see [`Looks::look`].
    pub(super) async fn look<F: Send + 'static, T: Send + 'static>(
        &self,
        look: Look<'_>,
        load: impl Future<Output = Result<F, Refusal>>,
        work: impl FnOnce(&F, &dyn Engine, &Limits, &Control) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Refusal> {
        let Inner { engine, limits, memory, settings, .. } = &*self.0;
        let (engine, memory, longest) = (Arc::clone(engine), memory.clone(), settings.job_timeout.0);
        self.0.looks.look(LookMeans { engine, limits: *limits, memory, longest }, look, load, work).await
    }

    /// Counts the end of a job, and tells those who wait.
    pub(super) fn announce_end(&self, id: &JobId, end: &FinishedJob) {
        let code = end.failure.as_ref().map_or_else(String::new, |failure| failure.code.clone());
        Metric::JobsFinished.count([("state", end.state.name().to_owned()), ("code", code.clone())], 1);
        if let Some(judgment) = &end.judgment {
            Metric::Verdicts.count([("verdict", judgment.verdict.name().to_owned())], 1);
        }
        Metric::LastJobFinished.set([], end.finished_at.as_millisecond() as f64 / 1e3);
        tracing::info!(job_id = %id, state = end.state.name(), code, "the job has ended");
        self.0.changes.announce(id, end.state);
        self.0.outbox.notify_one();
    }

    /// An end without results.
    pub(super) fn ending(&self, state: JobState, failure: Option<JobFailure>) -> FinishedJob {
        FinishedJob {
            state,
            finished_at: self.0.clock.now(),
            expires_at: self.0.clock.after(self.0.settings.job_retention.0),
            failure,
            stops_batch: (state == JobState::Failed).then(failure::stopped_by_another),
            report: None,
            resolved_spec: None,
            warnings: 0,
            judgment: None,
            results: Vec::new(),
            cache_key: None,
            cached_from: None,
        }
    }

    /// Ends what still waits of the batch that the failure of a job has stopped: jobs that were changing hands when it was. Gives how many.
    async fn end_left_of_batch(&self, id: &JobId, end: &FinishedJob) -> Result<u64, Refusal> {
        let records = self.0.store.records();
        let Some(failure) = end.stops_batch.clone().filter(|_| end.state == JobState::Failed && records.are_shared())
        else {
            return Ok(0);
        };
        let Some(job) = records.job(id).await? else { return Ok(0) };
        let Some(place) = job.batch else { return Ok(0) };
        match records.batch(&job.principal, &place.batch).await? {
            Some(batch) if batch.on_error == OnError::Stop => {
                let end = FinishedJob { state: JobState::Canceled, failure: Some(failure), ..end.clone() };
                Ok(records.end_left_waiting(&batch.id, &end).await?)
            }
            _ => Ok(0),
        }
    }

    /// Writes the end of a job that is in state `from` and in the hands of that lease, counts it, and tells those who wait. Gives
    /// `false` when the job is in another state or in other hands.
    pub(super) async fn finish(
        &self,
        id: &JobId,
        from: (JobState, Option<&LeaseId>),
        end: FinishedJob,
    ) -> Result<bool, Refusal> {
        let ended = self.0.store.records().finish_job(id, from, &end).await?;
        if let Ended::Written { stopped } = ended {
            self.0.stored_bytes.add(end.results.iter().map(|result| result.bytes).sum());
            Failpoint::JobEnded.reach();
            self.announce_end(id, &end);
            let left = self.end_left_of_batch(id, &end).await?;
            self.announce_stopped(stopped + left, end.stops_batch.as_ref());
        }
        Ok(ended.is_written())
    }
}
