//! Taking batches on, and asking again for what failed of them.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
};

use sha2::{Digest, Sha256};

use super::{
    super::{FailureReason, failure::stopped_by_another},
    BatchSnapshot,
};
use crate::{
    config::Failpoint,
    engine::{Control, Failure, FailureCode, Knowledge, Limits, NamedBytes, nearest},
    jobs::{
        Engine, EngineRequest, JobQuota, Jobs, NewJob, Refusal, failure, hexadecimal,
        looks::Look,
        memory, result_names,
        submission::{ResolvedJob, SubmissionContext, check_inputs, said_bytes, suspect_digest, text_bytes},
    },
    store::{
        AddedAgain, AddedBatch, AssetId, BatchId, BatchPlace, BatchRecord, ConfigDocument, Idempotency, InputRole,
        JobFailure, JobId, JobInput, JobRecord, JobRequest, JobState, OnError, Principal, QueueDepth, StoredFieldError,
        VersionedName,
    },
    telemetry::Metric,
};

/// How often a batch is put together again whose files go while it is written.
const MAX_TRIES: usize = 3;

/// What somebody wants done together.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewBatch {
    /// The jobs. Keys of their own have no meaning.
    pub items: Vec<NewJob>,
    /// What a failure does to the jobs that wait.
    pub on_error: OnError,
    /// Whether one item that cannot be run is a reason not to run the others.
    pub is_atomic: bool,
    /// The user's own words about it.
    pub labels: BTreeMap<String, String>,
    /// The caller's own word for this request: who asks twice with the same has one batch.
    pub idempotency_key: Option<String>,
}

impl NewBatch {
    /// The word, and a digest of everything else.
    fn idempotency(&self) -> Option<Idempotency> {
        let key = self.idempotency_key.clone()?;
        // The digest of a JSON list of all of it, of which never more than one item is there.
        let mut digest = Sha256::new();
        digest.update("[[");
        for (place, item) in self.items.iter().enumerate() {
            digest.update(if place == 0 { "" } else { "," });
            digest.update(item.asked().to_string());
        }
        let rest = serde_json::json!([self.on_error.name(), self.is_atomic, self.labels]).to_string();
        digest.update("],");
        digest.update(&rest[1..]);
        Some(Idempotency { key, asked_sha256: hexadecimal(&digest.finalize()) })
    }
}

/// A batch that was asked for.
#[derive(Clone, Debug)]
pub struct SubmittedBatch {
    /// The batch as it is now.
    pub batch: BatchSnapshot,
    /// Whether it had been asked for before, with the same word.
    pub is_repeated: bool,
    /// What is left of the caller's quota; nothing where there is none.
    pub quota: Option<JobQuota>,
}

/// An item of a batch that cannot be run.
#[derive(Clone, Debug, PartialEq)]
pub struct BadItem {
    /// Which one, from 0.
    pub item: u64,
    /// Why.
    pub failure: JobFailure,
}

/// An item as it was looked up. What cannot be run is kept as it was asked for.
struct Item {
    wanted: ResolvedJob,
    failure: Option<JobFailure>,
}

impl Jobs {
    /// Whether a new batch would be taken now; to be asked before a large body is read.
    ///
    /// # Errors
    /// [`Refusal::Draining`] or [`Refusal::QueueFull`].
    pub async fn check_batch_admission(&self) -> Result<(), Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        let size = QueueDepth { batch_jobs: 1, ..QueueDepth::default() };
        self.0.admission.check_room(self.0.store.records(), size).await
    }

    /// Takes a batch on, all its jobs in one transaction. When this returns, they survive a crash. With a key that came before, it is the
    /// batch from then.
    ///
    /// # Errors
    /// When the queue is full, the service is going down, the key came before with something else, or an item cannot be run of which all or
    /// none were asked for.
    pub async fn submit_batch(&self, owner: &Principal, new: NewBatch) -> Result<SubmittedBatch, Refusal> {
        let idempotency = new.idempotency();
        if let Some(asked) = &idempotency
            && let Some(before) = self.0.store.records().batch_asked_with(owner, &asked.key).await?
        {
            return self.repeated_batch(before, asked).await;
        }
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        for _ in 0..MAX_TRIES {
            let mut items = self.look_up(owner, new.items.clone()).await?;
            result_names::tell_apart(items.iter_mut().map(|item| &mut item.wanted.request));
            let bad = items.iter().zip(0..).find_map(|(item, number)| Some((number, item.failure.clone()?)));
            if let Some((item, failure)) = bad.as_ref().filter(|_| new.is_atomic) {
                return Err(Refusal::BadItem { item: *item, failure: Box::new(failure.clone()) });
            }
            let batch = BatchRecord {
                id: BatchId::new(),
                principal: owner.clone(),
                created_at: self.0.clock.now(),
                on_error: new.on_error,
                items: items.len() as u64,
                labels: new.labels.clone(),
                idempotency: idempotency.clone(),
            };
            let is_stopped = bad.is_some() && new.on_error == OnError::Stop;
            let items = items.into_iter().zip(0..).map(|(item, number)| (number, item));
            let jobs = self.records_of(&batch.id, items, is_stopped);
            let waiting = waiting(&jobs);
            let quota = self.quota_for(owner, waiting).await?;
            let bytes = jobs.iter().map(|job| text_bytes(&job.request)).sum();
            self.0.record_room.make((&self.0.store, &self.0.settings), owner, jobs.len() as u64, bytes).await?;
            self.0.store.blobs().check_room()?;
            let size = QueueDepth { batch_jobs: waiting, ..QueueDepth::default() };
            let reservation = self.0.admission.reserve(self.0.store.records(), size).await?;
            Failpoint::BeforeJobRecord.reach();
            match self.0.store.records().add_batch(&batch, &jobs).await? {
                AddedBatch::New => {}
                // What is missing will be seen to be when the items are looked up again.
                AddedBatch::FileMissing => continue,
                AddedBatch::Before(before) => match &batch.idempotency {
                    Some(asked) => return self.repeated_batch(*before, asked).await,
                    None => return Err(key_reused(&before)),
                },
            }
            Failpoint::AfterJobRecord.reach();
            reservation.fill();
            Metric::BatchesSubmitted.count([], 1);
            self.announce_batch(&jobs);
            let quota = quota.map(|quota| JobQuota { unfinished: quota.unfinished + waiting, ..quota });
            return Ok(SubmittedBatch { batch: self.batch(owner, &batch.id).await?, is_repeated: false, quota });
        }
        Err(files_keep_going())
    }

    /// The items of a batch that could not be run, were it asked for.
    ///
    /// # Errors
    /// As [`Jobs::submit_batch`], as far as that can be known before.
    pub async fn check_batch(&self, owner: &Principal, new: NewBatch) -> Result<Vec<BadItem>, Refusal> {
        let items = self.look_up(owner, new.items).await?.into_iter().zip(0..);
        let bad: Vec<BadItem> =
            items.filter_map(|(item, number)| Some(BadItem { item: number, failure: item.failure? })).collect();
        match bad.first() {
            Some(BadItem { item, failure }) if new.is_atomic => {
                Err(Refusal::BadItem { item: *item, failure: Box::new(failure.clone()) })
            }
            _ => Ok(bad),
        }
    }

    /// Asks again for the items of a batch that failed, or did not start since another one failed, and where `with_canceled` for those that
    /// were canceled. Gives the batch, and how many they were.
    ///
    /// # Errors
    /// When its owner has no such batch, or new jobs would not be taken.
    pub async fn retry_failed(
        &self,
        owner: &Principal,
        id: &BatchId,
        with_canceled: bool,
    ) -> Result<(BatchSnapshot, u64), Refusal> {
        for _ in 0..MAX_TRIES {
            self.batch(owner, id).await?;
            if self.is_draining() {
                return Err(Refusal::Draining);
            }
            let failed = self.0.store.records().failed_batch_jobs(id, with_canceled).await?;
            if failed.is_empty() {
                break;
            }
            let (numbers, older): (Vec<u64>, Vec<JobId>) =
                failed.iter().filter_map(|job| Some((job.batch.as_ref()?.item, job.id.clone()))).unzip();
            // Looked up as if they came for the first time: files and presets may be there by now, or no longer.
            let names: Vec<Option<String>> = failed.iter().map(|job| job.request.result_name.clone()).collect();
            let mut items = self.look_up(owner, failed.into_iter().map(asked_before).collect()).await?;
            for ((item, older), name) in items.iter_mut().zip(older).zip(names) {
                item.wanted.retry_of = Some(older);
                item.wanted.request.result_name = name;
            }
            let jobs = self.records_of(id, numbers.into_iter().zip(items), false);
            let waiting = waiting(&jobs);
            self.quota_for(owner, waiting).await?;
            let bytes = jobs.iter().map(|job| text_bytes(&job.request)).sum();
            self.0.record_room.make((&self.0.store, &self.0.settings), owner, jobs.len() as u64, bytes).await?;
            let size = QueueDepth { batch_jobs: waiting, ..QueueDepth::default() };
            let reservation = self.0.admission.reserve(self.0.store.records(), size).await?;
            if self.0.store.records().add_again(owner, &jobs).await? == AddedAgain::New {
                reservation.fill();
                self.announce_batch(&jobs);
                return Ok((self.batch(owner, id).await?, jobs.len() as u64));
            }
        }
        Ok((self.batch(owner, id).await?, 0))
    }

    async fn repeated_batch(&self, before: BatchRecord, asked: &Idempotency) -> Result<SubmittedBatch, Refusal> {
        if before.idempotency.as_ref() != Some(asked) {
            return Err(key_reused(&before));
        }
        let batch = self.batch(&before.principal, &before.id).await?;
        Ok(SubmittedBatch { batch, is_repeated: true, quota: self.quota(&before.principal).await? })
    }

    /// Looks up what jobs name, and checks of each what can be checked without reading its files.
    async fn look_up(&self, owner: &Principal, jobs: Vec<NewJob>) -> Result<Vec<Item>, Refusal> {
        let known = self.known(owner, &jobs).await?;
        let mut items = Vec::with_capacity(jobs.len());
        let (mut bytes, most) = (0, self.0.settings.max_batch_bytes.0);
        for new in jobs {
            let asked = as_asked(&known, owner, &new)?;
            let item = match self.resolve_with(&known, owner, new) {
                Ok(wanted) => Item { wanted, failure: None },
                Err(refusal) => Item { wanted: asked, failure: Some(failure_of(refusal)?) },
            };
            bytes += said_bytes(&item.wanted.request);
            if bytes > most {
                let what = "what the items of the batch have of configs, labels and rigs of your own".to_owned();
                return Err(Refusal::TooLarge { what, limit: "batch_bytes", most, actual: bytes });
            }
            items.push(item);
        }
        self.find_quarantined(&mut items).await?;
        self.check_configs(owner, &mut items).await?;
        Ok(items)
    }

    async fn find_quarantined(&self, items: &mut [Item]) -> Result<(), Refusal> {
        let digests: Vec<String> =
            items.iter().map(|item| suspect_digest(&item.wanted.owner, &item.wanted.request)).collect();
        let distinct: Vec<&str> = digests.iter().map(String::as_str).collect::<BTreeSet<_>>().into_iter().collect();
        let quarantined = self.0.store.records().quarantined(&distinct, self.0.clock.now()).await?;
        for (item, digest) in items.iter_mut().zip(&digests) {
            if let (None, Some(until)) = (&item.failure, quarantined.get(digest)) {
                item.failure = Some(failure_of(Refusal::Quarantined { until: *until })?);
            }
        }
        Ok(())
    }

    /// Checks every config once, however many items have it.
    async fn check_configs(&self, owner: &Principal, items: &mut [Item]) -> Result<(), Refusal> {
        let configs = items.iter().filter_map(|item| item.wanted.request.config.as_ref());
        let distinct: BTreeMap<Arc<str>, ConfigDocument> =
            configs.map(|config| (Arc::clone(&config.text), config.clone())).collect();
        if distinct.is_empty() {
            return Ok(());
        }
        let bytes = distinct.keys().map(|text| text.len() as u64).max().unwrap_or(0);
        let memory_bytes = memory::of_job([memory::of_unknown_file(bytes)].into_iter(), 1.0);
        let look = Look { owner, thread: "check", what: "reading the configs", memory_bytes };
        let refused = self.look(look, std::future::ready(Ok(distinct)), check_all).await?;
        for item in items.iter_mut().filter(|item| item.failure.is_none()) {
            let config = item.wanted.request.config.as_ref();
            item.failure = config.and_then(|config| refused.get(&config.text)).cloned().map(failure::keep);
        }
        Ok(())
    }

    /// The jobs of items, each with its number. What cannot be run has failed, and where that stops the batch, the others do not start.
    fn records_of(
        &self,
        batch: &BatchId,
        items: impl Iterator<Item = (u64, Item)>,
        is_stopped: bool,
    ) -> Vec<JobRecord> {
        let (now, expires_at) = (self.0.clock.now(), self.0.clock.after(self.0.settings.job_retention.0));
        let record = |(item, Item { wanted, failure }): (u64, Item)| {
            let waits = JobRecord { batch: Some(BatchPlace { batch: batch.clone(), item }), ..wanted.into_record(now) };
            let (state, failure) = match failure {
                Some(failure) => (JobState::Failed, failure),
                None if is_stopped => (JobState::Canceled, stopped_by_another()),
                None => return waits,
            };
            let (finished_at, expires_at) = (Some(now), Some(expires_at));
            JobRecord { state, failure: Some(failure), finished_at, expires_at, ..waits }
        };
        items.map(record).collect()
    }

    /// Counts jobs that were taken on together, and wakes who takes them up.
    fn announce_batch(&self, jobs: &[JobRecord]) {
        Metric::JobsSubmitted.count([], jobs.len() as u64);
        for failure in jobs.iter().filter_map(|job| job.failure.as_ref().filter(|_| job.state == JobState::Failed)) {
            Metric::JobsFinished.count([("state", "failed".to_owned()), ("code", failure.code.clone())], 1);
        }
        let stopped = jobs.iter().filter(|job| job.state == JobState::Canceled).count() as u64;
        self.announce_stopped(stopped, Some(&stopped_by_another()));
        self.0.changes.announce_anything();
    }
}

/// Why configs cannot be used, by their texts.
fn check_all(
    configs: &BTreeMap<Arc<str>, ConfigDocument>,
    engine: &dyn Engine,
    limits: &Limits,
    control: &Control,
) -> Result<BTreeMap<Arc<str>, Failure>, Failure> {
    let mut refused = BTreeMap::new();
    for (text, config) in configs {
        control.check().map_err(|_| Failure::new(FailureCode::Canceled, "canceled"))?;
        let named = NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() };
        if let Err(failure) = engine.ask(&EngineRequest::of_config(named, &Knowledge::default(), limits), control) {
            refused.insert(Arc::clone(text), failure);
        }
    }
    Ok(refused)
}

fn waiting(jobs: &[JobRecord]) -> u64 {
    jobs.iter().filter(|job| job.state == JobState::Queued).count() as u64
}

fn key_reused(before: &BatchRecord) -> Refusal {
    Refusal::KeyReused { kind: "batch", id: before.id.to_string() }
}

fn files_keep_going() -> Refusal {
    Refusal::UnknownInput { role: InputRole::Source, id: String::new() }
}

/// What was asked for when this job was.
fn asked_before(job: JobRecord) -> NewJob {
    let inputs = job.request.inputs.iter().map(|(role, input)| (*role, input.asset.clone())).collect();
    let formats = job.request.formats.iter().filter_map(|name| crate::engine::Format::from_name(name)).collect();
    // The preset is in the config already, unless it was not found.
    let is_unknown = job.failure.as_ref().is_some_and(|failure| failure.code == FailureReason::UnknownPreset.name());
    let JobRequest { task, config, labels, preset, skip_cache, webhook, .. } = job.request;
    NewJob {
        task: Some(task),
        inputs,
        config,
        formats,
        labels,
        preset: preset.filter(|_| is_unknown).map(|preset| preset.name),
        priority: job.priority,
        skip_cache,
        webhook,
        idempotency_key: None,
    }
}

/// A job as it was asked for, with what is known of its files.
fn as_asked(known: &SubmissionContext, owner: &Principal, new: &NewJob) -> Result<ResolvedJob, Refusal> {
    let input = |(role, asset): (&InputRole, &AssetId)| {
        let (sha256, file_name) =
            known.asset(asset).map(|found| (found.sha256.clone(), found.file_name.clone())).unwrap_or_default();
        (*role, JobInput { asset: asset.clone(), sha256, file_name })
    };
    let task =
        new.task.clone().unwrap_or_else(|| known.task_of(new.config.as_ref(), new.inputs.get(&InputRole::Target)));
    check_inputs(&task, &new.inputs)?;
    let request = JobRequest {
        task,
        inputs: new.inputs.iter().map(input).collect(),
        config: new.config.clone(),
        formats: new.formats.iter().map(|format| format.info().name.to_owned()).collect(),
        labels: new.labels.clone(),
        preset: new.preset.clone().map(|name| VersionedName { name, version: 0 }),
        rigs: Vec::new(),
        result_name: None,
        skip_cache: new.skip_cache,
        webhook: new.webhook.clone(),
    };
    Ok(ResolvedJob {
        owner: owner.clone(),
        request,
        input_bytes: 0,
        memory_bytes: 0,
        priority: new.priority,
        retry_of: None,
        idempotency: None,
    })
}

/// Why an item cannot be run.
///
/// # Errors
/// What is no fault of the item.
fn failure_of(refusal: Refusal) -> Result<JobFailure, Refusal> {
    let detail = refusal.to_string();
    let (reason, hint, part, did_you_mean) = match refusal {
        Refusal::UnknownInput { role, .. } => {
            (FailureReason::UnknownAsset, "upload the file and name the id that it is given", role.name(), Vec::new())
        }
        Refusal::UnknownPreset { name, known } => (
            FailureReason::UnknownPreset,
            "GET /v1/presets lists them",
            "preset",
            nearest(&name, known.iter().map(String::as_str)),
        ),
        Refusal::UnknownWebhook { .. } => {
            (FailureReason::UnknownWebhook, "GET /v1/webhooks lists them", "webhook", Vec::new())
        }
        Refusal::Quarantined { .. } => (FailureReason::Quarantined, "try again later", "", Vec::new()),
        Refusal::Engine(failure) => return Ok(failure::keep(failure)),
        other => return Err(other),
    };
    let pointer = match reason {
        FailureReason::UnknownAsset => format!("/{part}/asset"),
        FailureReason::UnknownPreset | FailureReason::UnknownWebhook => format!("/{part}"),
        _ => return Ok(reason.because(detail, hint)),
    };
    let error = StoredFieldError { pointer, code: reason.name().to_owned(), detail: detail.clone(), did_you_mean };
    Ok(JobFailure { part: part.to_owned(), errors: vec![error], ..reason.because(detail, hint) })
}
