//! Taking jobs on.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::{Arc, Mutex, PoisonError},
};

use jiff::Timestamp;

use super::{
    JobQuota, Jobs, Kept, Refusal,
    admission::Reservation,
    inspections::InspectionKey,
    library::{self, OwnRigs},
    memory,
};
use crate::{
    config::Failpoint,
    engine::{self, Failure, FailureCode, Format, NamedBytes, TaskKind},
    store::{
        Added, AssetId, AssetRecord, ConfigDocument, Idempotency, InputRole, JobId, JobInput, JobKind, JobRecord,
        JobRequest, JobState, JobTask, Principal, QueueDepth, VersionedName, WebhookId,
    },
    telemetry::{Metric, TraceContext},
};

/// What somebody wants done.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct NewJob {
    /// What is to be done; nothing where the config says it.
    pub task: Option<JobTask>,
    /// The files, by what they are to it.
    pub inputs: BTreeMap<InputRole, AssetId>,
    /// The retarget config.
    pub config: Option<ConfigDocument>,
    /// The formats wanted. Empty: what the config says.
    pub formats: Vec<Format>,
    /// The user's own words about it.
    pub labels: BTreeMap<String, String>,
    /// The preset that the config is laid over.
    pub preset: Option<String>,
    /// Among the jobs of one principal, the greater goes first.
    pub priority: i32,
    /// Whether it is to be run although its results may be there already.
    pub skip_cache: bool,
    /// The webhook that is told of its end, whatever that listens to.
    pub webhook: Option<WebhookId>,
    /// The caller's own word for this request: who asks twice with the same has one job.
    pub idempotency_key: Option<String>,
}

impl NewJob {
    /// The word, and a digest of everything else.
    fn idempotency(&self) -> Option<Idempotency> {
        let key = self.idempotency_key.clone()?;
        Some(Idempotency { key, asked_sha256: library::digest(&self.asked().to_string()) })
    }

    /// Everything but the word.
    pub(super) fn asked(&self) -> serde_json::Value {
        let Self { task, inputs, config, formats, labels, preset, priority, skip_cache, webhook, idempotency_key: _ } =
            self;
        let inputs: Vec<_> = inputs.iter().map(|(role, asset)| (role.name(), asset)).collect();
        let formats: Vec<_> = formats.iter().map(|format| format.info().name).collect();
        let config = config.as_ref().map(|config| &*config.text);
        let mut asked = serde_json::json!([inputs, config, formats, labels, preset, priority, skip_cache]);
        // Only where there is one, so that a digest from before there were webhooks stays what it is.
        if let (Some(webhook), Some(asked)) = (webhook, asked.as_array_mut()) {
            asked.push(serde_json::json!(webhook));
        }
        if let (Some(task), Some(asked)) = (task, asked.as_array_mut()) {
            asked.push(serde_json::json!(task));
        }
        asked
    }
}

/// A job that was asked for.
#[derive(Clone, Debug)]
pub struct Submitted {
    /// The job as it was taken on, or as it is when it had been asked for before.
    pub job: JobRecord,
    /// Whether it had been asked for before, with the same word.
    pub is_repeated: bool,
    /// What is left of the caller's quota; nothing where there is none.
    pub quota: Option<JobQuota>,
}

/// A job that can be taken on: its files are there.
pub(super) struct ResolvedJob {
    pub(super) owner: Principal,
    pub(super) request: JobRequest,
    pub(super) input_bytes: u64,
    pub(super) memory_bytes: u64,
    pub(super) priority: i32,
    pub(super) retry_of: Option<JobId>,
    pub(super) idempotency: Option<Idempotency>,
}

impl ResolvedJob {
    /// As it was before, to be asked for again.
    pub(super) fn again(ended: JobRecord) -> Self {
        let JobRecord { id, principal: owner, request, input_bytes, priority, memory_bytes, .. } = ended;
        Self { owner, request, input_bytes, memory_bytes, priority, retry_of: Some(id), idempotency: None }
    }

    /// The record of the job, which waits.
    pub(super) fn into_record(self, created_at: Timestamp) -> JobRecord {
        let Self { owner, request, input_bytes, memory_bytes, priority, retry_of, idempotency } = self;
        JobRecord {
            id: JobId::new(),
            state: JobState::Queued,
            inputs_sha256: suspect_digest(&owner, &request),
            request,
            input_bytes,
            attempt: 0,
            retry_of,
            created_at,
            started_at: None,
            finished_at: None,
            expires_at: None,
            warnings: 0,
            judgment: None,
            failure: None,
            principal: owner,
            priority,
            memory_bytes,
            crashes: 0,
            retries: 0,
            idempotency,
            lease: None,
            progress: None,
            trace_context: TraceContext::current().map(|context| context.to_string()),
            cache_key: None,
            cached_from: None,
            batch: None,
        }
    }
}

/// A job that has room in the queue and is not in the store yet. Dropping it gives the room back.
pub(super) struct Admitted {
    pub(super) record: JobRecord,
    quota: Option<JobQuota>,
    reservation: Reservation,
}

/// What jobs of one owner are resolved with, looked up once.
pub(super) struct SubmissionContext {
    rigs: OwnRigs,
    assets: BTreeMap<AssetId, AssetRecord>,
    /// Those that are not there have the names of those that are.
    presets: BTreeMap<String, Result<Kept, Vec<String>>>,
    webhooks: BTreeSet<WebhookId>,
    configs: Mutex<ReadConfigs>,
}

/// The name of a preset, and the text that is laid over it.
type OverPreset = (String, Option<Arc<str>>);

/// What was read of configs, once however many jobs have them.
#[derive(Default)]
struct ReadConfigs {
    /// What comes of laying them over presets.
    laid: BTreeMap<OverPreset, Result<Arc<str>, Failure>>,
    /// By the text.
    facts: BTreeMap<Arc<str>, ConfigFacts>,
}

/// What taking a job on has to know of its config.
#[derive(Clone, Copy)]
struct ConfigFacts {
    kind: JobKind,
    /// How many times larger than its files it makes a job.
    growth: f64,
}

impl SubmissionContext {
    /// What a config asks for, where nothing else says it: of a drawing, that it moves.
    pub(super) fn task_of(&self, config: Option<&ConfigDocument>, target: Option<&AssetId>) -> JobTask {
        let task = JobTask::of_kind(self.facts_of(config).kind);
        let is_drawing =
            target.and_then(|id| self.asset(id)).is_some_and(|asset| asset.format == Format::Drawing.info().name);
        if task == JobTask::Retarget && is_drawing { JobTask::Draw } else { task }
    }

    fn facts_of(&self, config: Option<&ConfigDocument>) -> ConfigFacts {
        let Some(config) = config else { return ConfigFacts { kind: JobKind::default(), growth: 1.0 } };
        let mut read = self.configs.lock().unwrap_or_else(PoisonError::into_inner);
        *read.facts.entry(Arc::clone(&config.text)).or_insert_with(|| ConfigFacts::of(config))
    }

    /// A config laid over a preset.
    fn lay(&self, preset: &Kept, config: Option<&ConfigDocument>) -> Result<Arc<str>, Failure> {
        let bytes = config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() });
        let key = (preset.name.clone(), config.map(|config| Arc::clone(&config.text)));
        let mut read = self.configs.lock().unwrap_or_else(PoisonError::into_inner);
        let laid = read.laid.entry(key);
        laid.or_insert_with(|| engine::merge_config(&preset.document, bytes).map(Arc::from)).clone()
    }

    /// What is known of a file.
    pub(super) fn asset(&self, id: &AssetId) -> Option<&AssetRecord> {
        self.assets.get(id)
    }

    /// The webhook that a job names, when its owner has it.
    fn webhook(&self, id: Option<WebhookId>) -> Result<Option<WebhookId>, Refusal> {
        match id {
            Some(id) if !self.webhooks.contains(&id) => Err(Refusal::UnknownWebhook { id }),
            known => Ok(known),
        }
    }
}

impl Jobs {
    /// Whether a new job would be taken now; to be asked before a large body is read.
    ///
    /// # Errors
    /// [`Refusal::Draining`] or [`Refusal::QueueFull`].
    pub async fn check_admission(&self) -> Result<(), Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        self.0.admission.check_room(self.0.store.records(), QueueDepth { jobs: 1, ..QueueDepth::default() }).await
    }

    /// Takes a job on. When this returns, the job survives a crash. With a key that came before, it is the job from then.
    ///
    /// # Errors
    /// When the queue is full, the service is going down, an input is not there, or the key came before with something else.
    pub async fn submit(&self, owner: &Principal, new: NewJob) -> Result<Submitted, Refusal> {
        let idempotency = new.idempotency();
        if let Some(asked) = &idempotency
            && let Some(before) = self.0.store.records().job_asked_with(owner, &asked.key).await?
        {
            return self.repeated(before, asked).await;
        }
        self.enqueue(ResolvedJob { idempotency, ..self.resolve(owner, new).await? }).await
    }

    /// The job that was asked for before with the same key.
    async fn repeated(&self, before: JobRecord, asked: &Idempotency) -> Result<Submitted, Refusal> {
        if before.idempotency.as_ref() != Some(asked) {
            return Err(key_of_job(before));
        }
        let quota = self.quota(&before.principal).await?;
        Ok(Submitted { job: before, is_repeated: true, quota })
    }

    pub(super) async fn resolve(&self, owner: &Principal, new: NewJob) -> Result<ResolvedJob, Refusal> {
        let known = self.known(owner, std::slice::from_ref(&new)).await?;
        self.resolve_with(&known, owner, new)
    }

    /// Looks up what these jobs name.
    pub(super) async fn known(&self, owner: &Principal, jobs: &[NewJob]) -> Result<SubmissionContext, Refusal> {
        let ids: BTreeSet<&AssetId> = jobs.iter().flat_map(|job| job.inputs.values()).collect();
        let mut assets = self.keep_built_in(owner, &ids).await?;
        assets.extend(self.0.store.records().assets_of(owner, &ids.into_iter().collect::<Vec<_>>()).await?);
        self.known_with(owner, jobs, assets).await
    }

    /// Looks up what these jobs name besides files.
    pub(super) async fn known_with(
        &self,
        owner: &Principal,
        jobs: &[NewJob],
        assets: BTreeMap<AssetId, AssetRecord>,
    ) -> Result<SubmissionContext, Refusal> {
        let names: BTreeSet<&String> = jobs.iter().filter_map(|job| job.preset.as_ref()).collect();
        let mut presets = BTreeMap::new();
        for name in names {
            let found = match self.preset(owner, name).await {
                Ok(kept) => Ok(kept),
                Err(Refusal::UnknownPreset { known, .. }) => Err(known),
                Err(refusal) => return Err(refusal),
            };
            presets.insert(name.clone(), found);
        }
        let mut webhooks = BTreeSet::new();
        for id in jobs.iter().filter_map(|job| job.webhook.as_ref()).collect::<BTreeSet<_>>() {
            let found = self.0.store.records().webhook(id).await?;
            webhooks.extend(found.filter(|webhook| webhook.principal == *owner).map(|_| id.clone()));
        }
        Ok(SubmissionContext {
            rigs: library::own_rigs(&self.0.store, owner).await?,
            assets,
            presets,
            webhooks,
            configs: Mutex::default(),
        })
    }

    /// What a job is that names things which were looked up.
    pub(super) fn resolve_with(
        &self,
        known: &SubmissionContext,
        owner: &Principal,
        new: NewJob,
    ) -> Result<ResolvedJob, Refusal> {
        let target = new.inputs.get(&InputRole::Target).cloned();
        let (mut found, mut input_bytes, mut needs) = (BTreeMap::new(), 0, Vec::new());
        for (role, id) in new.inputs {
            let Some(asset) = known.asset(&id) else {
                return Err(Refusal::UnknownInput { role, id: id.to_string() });
            };
            input_bytes += asset.bytes;
            needs.push(self.memory_need(asset, &known.rigs.sha256)?);
            let (sha256, file_name) = (asset.sha256.clone(), asset.file_name.clone());
            // Not the id that it was asked for by: a built-in asset is kept under another.
            found.insert(role, JobInput { asset: asset.id.clone(), sha256, file_name });
        }
        let (config, preset) = lay_over_preset(known, new.config, new.preset)?;
        let task = new.task.unwrap_or_else(|| known.task_of(config.as_ref(), target.as_ref()));
        check_inputs(&task, &found)?;
        let request = JobRequest {
            task,
            inputs: found,
            config,
            formats: new.formats.into_iter().map(|format| format.info().name.to_owned()).collect(),
            labels: new.labels,
            preset,
            rigs: known.rigs.versions(),
            result_name: None,
            skip_cache: new.skip_cache,
            webhook: known.webhook(new.webhook)?,
        };
        let growth = known.facts_of(request.config.as_ref()).growth + memory::growth_of_formats(request.formats.len());
        let memory_bytes = memory::of_job(needs.into_iter(), growth);
        let (owner, priority) = (owner.clone(), new.priority);
        Ok(ResolvedJob { owner, request, input_bytes, memory_bytes, priority, retry_of: None, idempotency: None })
    }

    /// What a file adds to the memory that a job needs: by what was found in it, else by its size.
    fn memory_need(&self, asset: &AssetRecord, rigs_sha256: &str) -> Result<u64, Refusal> {
        let most = self.0.settings.memory_budget.0;
        match self.0.inspections.memory_bytes(&InspectionKey::of(asset, rigs_sha256)) {
            Some(bytes) if bytes > most => Err(Failure::new(
                FailureCode::AssetLimitExceeded,
                format!("a job on the file '{}' would need about {bytes} bytes of memory", asset.file_name),
            )
            .with_hint("the limit is 'memory_budget'; send fewer frames or joints")
            .into()),
            Some(bytes) => Ok(bytes),
            None => Ok(memory::of_unknown_file(asset.bytes)),
        }
    }

    /// Asks for the same again.
    pub(super) async fn submit_again(&self, ended: JobRecord) -> Result<Submitted, Refusal> {
        let mut wanted = ResolvedJob::again(ended);
        // Who asks again for what is there wants it computed again.
        wanted.request.skip_cache = true;
        self.enqueue(wanted).await
    }

    /// What is left of a quota, when there is room in it for so many more.
    pub(super) async fn quota_for(&self, owner: &Principal, asked: u64) -> Result<Option<JobQuota>, Refusal> {
        let quota = self.quota(owner).await?;
        if let Some(quota) = quota.filter(|quota| quota.unfinished.saturating_add(asked) > quota.most) {
            Metric::AdmissionRejected.count([("reason", "quota".to_owned())], 1);
            return Err(Refusal::QuotaReached { quota, asked });
        }
        Ok(quota)
    }

    async fn enqueue(&self, wanted: ResolvedJob) -> Result<Submitted, Refusal> {
        let admitted = self.admit(wanted).await?;
        self.add(admitted, &[]).await
    }

    /// Gives a job its record and room in the queue; it is not in the store yet.
    pub(super) async fn admit(&self, wanted: ResolvedJob) -> Result<Admitted, Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        let (records, now) = (self.0.store.records(), self.0.clock.now());
        let record = wanted.into_record(now);
        if let Some(until) = records.quarantined(&[&record.inputs_sha256], now).await?.into_values().next() {
            return Err(Refusal::Quarantined { until });
        }
        let quota = self.quota_for(&record.principal, 1).await?;
        self.0
            .record_room
            .make((&self.0.store, &self.0.settings), &record.principal, 1, text_bytes(&record.request))
            .await?;
        self.0.store.blobs().check_room()?;
        let size = QueueDepth { jobs: 1, bytes: record.input_bytes, batch_jobs: 0 };
        let reservation = self.0.admission.reserve(records, size).await?;
        Ok(Admitted { record, quota, reservation })
    }

    /// Puts a job into the store, with the records of files that came with it and whose bytes are there.
    pub(super) async fn add(&self, admitted: Admitted, assets: &[AssetRecord]) -> Result<Submitted, Refusal> {
        let Admitted { mut record, quota, reservation } = admitted;
        Failpoint::BeforeJobRecord.reach();
        let (added, kept) = self.0.store.records().add_job_with_assets(&mut record, assets).await?;
        match added {
            Added::New => self.0.stored_bytes.add_new(&kept),
            Added::FileMissing => {
                let (role, input) = self.first_missing(&record).await?;
                return Err(Refusal::UnknownInput { role, id: input.asset.to_string() });
            }
            // The same request came twice at the same time, and the other one was faster.
            Added::Before(before) => match &record.idempotency {
                Some(asked) => return self.repeated(*before, asked).await,
                None => return Err(key_of_job(*before)),
            },
        }
        Failpoint::AfterJobRecord.reach();
        reservation.fill();
        Metric::JobsSubmitted.count([], 1);
        self.0.changes.announce(&record.id, JobState::Queued);
        let quota = quota.map(|quota| JobQuota { unfinished: quota.unfinished + 1, ..quota });
        Ok(Submitted { job: record, is_repeated: false, quota })
    }

    async fn first_missing<'a>(&self, job: &'a JobRecord) -> Result<(InputRole, &'a JobInput), Refusal> {
        for (role, input) in &job.request.inputs {
            if self.0.store.records().asset(&job.principal, &input.asset).await?.is_none() {
                return Ok((*role, input));
            }
        }
        job.request.inputs.first_key_value().map(|(role, input)| (*role, input)).ok_or(no_input(InputRole::Source))
    }
}

const fn no_input(role: InputRole) -> Refusal {
    Refusal::UnknownInput { role, id: String::new() }
}

/// Refuses a task that lacks a file.
pub(super) fn check_inputs<T>(task: &JobTask, inputs: &BTreeMap<InputRole, T>) -> Result<(), Refusal> {
    task.needs().iter().find(|role| !inputs.contains_key(role)).map_or(Ok(()), |role| Err(no_input(*role)))
}

fn key_of_job(job: JobRecord) -> Refusal {
    Refusal::KeyReused { kind: "job", id: job.id.to_string() }
}

/// The config with the preset under it. What comes out is the job's own: it does not change when the preset does.
fn lay_over_preset(
    known: &SubmissionContext,
    config: Option<ConfigDocument>,
    preset: Option<String>,
) -> Result<(Option<ConfigDocument>, Option<VersionedName>), Refusal> {
    let Some(name) = preset else { return Ok((config, None)) };
    let kept = match known.presets.get(&name) {
        Some(Ok(kept)) => kept,
        Some(Err(known)) => return Err(Refusal::UnknownPreset { name, known: known.clone() }),
        None => return Err(Refusal::UnknownPreset { name, known: Vec::new() }),
    };
    let text = known.lay(kept, config.as_ref())?;
    let version = kept.own.map_or(0, |(version, _)| version);
    let config = ConfigDocument { file_name: "config.json".to_owned(), text };
    Ok((Some(config), Some(VersionedName { name, version })))
}

impl ConfigFacts {
    fn of(config: &ConfigDocument) -> Self {
        let text = config.text.as_bytes();
        let task = engine::task_of(Some(NamedBytes { name: &config.file_name, bytes: text }));
        let document = says_edit(text).then(|| engine::parse_config(text).ok()).flatten();
        Self {
            kind: match task {
                TaskKind::Retarget => JobKind::Retarget,
                TaskKind::Edit => JobKind::Edit,
                TaskKind::Pose => JobKind::Pose,
                TaskKind::Draw => JobKind::Draw,
            },
            growth: document.map_or(1.0, |document| memory::growth_of_config(&document)),
        }
    }
}

/// About how many bytes of a record a request is.
pub(super) fn text_bytes(request: &JobRequest) -> u64 {
    /// Its row, its names and its places in indices.
    const ROW: u64 = 2048;
    ROW + said_bytes(request)
}

/// How many bytes a request has that are as many as its caller likes: its config, its labels, and the versions of the caller's rigs.
pub(super) fn said_bytes(request: &JobRequest) -> u64 {
    /// The names of its members, and what stands between them.
    const FRAME: usize = 24;
    let config = request.config.as_ref().map_or(0, |config| config.text.len());
    let labels: usize = request.labels.iter().map(|(name, text)| name.len() + text.len() + FRAME).sum();
    let rigs: usize = request.rigs.iter().map(|rig| rig.name.len() + FRAME).sum();
    (config + labels + rigs) as u64
}

/// Most configs change nothing of the clip's length, and need not be read for that.
fn says_edit(text: &[u8]) -> bool {
    text.windows(4).any(|word| word == b"edit")
}

/// A digest of who asks for what: the files of a job, what each is to it, its config and its formats. What brings workers down for one
/// caller with one config is nobody else's business, and nobody else's fault.
pub(super) fn suspect_digest(owner: &Principal, request: &JobRequest) -> String {
    let names = request.inputs.iter().map(|(role, input)| format!("{} {}\n", role.name(), input.sha256));
    let config = request.config.as_ref().map_or("", |config| &config.text);
    let formats = request.formats.join(" ");
    let task = serde_json::json!(request.task);
    library::digest(&format!("{owner}\n{task}\n{}{formats}\n{config}", names.collect::<String>()))
}
