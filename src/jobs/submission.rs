//! Taking jobs on.

use std::collections::BTreeMap;

use super::{JobQuota, JobSnapshot, Jobs, Refusal, inspections::InspectionKey, library, memory};
use crate::{
    config::Failpoint,
    engine::{self, Failure, FailureCode, Format, NamedBytes},
    store::{
        Added, AssetId, AssetRecord, ConfigDocument, Idempotency, InputRole, JobId, JobInput, JobKind, JobRecord,
        JobRequest, JobState, Principal, VersionedName, WebhookId,
    },
    telemetry::{Metric, TraceContext},
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
        let Self { inputs, config, formats, labels, preset, priority, skip_cache, webhook, idempotency_key: _ } = self;
        let inputs: Vec<_> = inputs.iter().map(|(role, asset)| (role.name(), asset)).collect();
        let formats: Vec<_> = formats.iter().map(|format| format.info().name).collect();
        let config = config.as_ref().map(|config| &config.text);
        let mut asked = serde_json::json!([inputs, config, formats, labels, preset, priority, skip_cache]);
        // Only where there is one, so that a digest from before there were webhooks stays what it is.
        if let (Some(webhook), Some(asked)) = (webhook, asked.as_array_mut()) {
            asked.push(serde_json::json!(webhook));
        }
        Some(Idempotency { key, asked_sha256: library::digest(&asked.to_string()) })
    }
}

/// A job that was asked for.
#[derive(Clone, Debug)]
pub struct Submitted {
    /// The job as it is now.
    pub job: JobSnapshot,
    /// Whether it had been asked for before, with the same word.
    pub is_repeated: bool,
    /// What is left of the caller's quota; nothing where there is none.
    pub quota: Option<JobQuota>,
}

/// A job that can be taken on: its files are there.
pub(super) struct Wanted {
    owner: Principal,
    pub(super) kind: JobKind,
    pub(super) request: JobRequest,
    input_bytes: u64,
    memory_bytes: u64,
    priority: i32,
    retry_of: Option<JobId>,
    idempotency: Option<Idempotency>,
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
        self.0.admission.check_room(self.0.store.records()).await
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
        self.enqueue(Wanted { idempotency, ..self.resolve(owner, new).await? }).await
    }

    /// The job that was asked for before with the same key.
    async fn repeated(&self, before: JobRecord, asked: &Idempotency) -> Result<Submitted, Refusal> {
        if before.idempotency.as_ref() != Some(asked) {
            return Err(Refusal::KeyReused { job: before.id });
        }
        let job = self.get(&before.principal, &before.id).await?;
        Ok(Submitted { job, is_repeated: true, quota: self.quota(&before.principal).await? })
    }

    pub(super) async fn resolve(&self, owner: &Principal, new: NewJob) -> Result<Wanted, Refusal> {
        let own_rigs = self.own_rigs(owner).await?;
        let (mut found, mut input_bytes, mut needs) = (BTreeMap::new(), 0, Vec::new());
        for (role, id) in new.inputs {
            let Some(asset) = self.0.store.records().asset(owner, &id).await? else {
                return Err(Refusal::UnknownInput { role, id: id.to_string() });
            };
            input_bytes += asset.bytes;
            needs.push(self.memory_need(&asset, &own_rigs.sha256)?);
            found.insert(role, JobInput { asset: id, sha256: asset.sha256, file_name: asset.file_name });
        }
        let missing = |role: InputRole| Refusal::UnknownInput { role, id: String::new() };
        let (config, preset) = self.lay_over_preset(owner, new.config, new.preset).await?;
        let request = JobRequest {
            source: found.remove(&InputRole::Source).ok_or_else(|| missing(InputRole::Source))?,
            target: found.remove(&InputRole::Target).ok_or_else(|| missing(InputRole::Target))?,
            source_rest: found.remove(&InputRole::SourceRest),
            target_rest: found.remove(&InputRole::TargetRest),
            config,
            formats: new.formats.into_iter().map(|format| format.info().name.to_owned()).collect(),
            labels: new.labels,
            preset,
            rigs: own_rigs.versions(),
            skip_cache: new.skip_cache,
            webhook: self.own_webhook(owner, new.webhook).await?,
        };
        let memory_bytes = memory::of_job(needs.into_iter());
        let (owner, priority, kind) = (owner.clone(), new.priority, kind_of(&request));
        Ok(Wanted { owner, kind, request, input_bytes, memory_bytes, priority, retry_of: None, idempotency: None })
    }

    /// The webhook that a job names, when its owner has it.
    async fn own_webhook(&self, owner: &Principal, id: Option<WebhookId>) -> Result<Option<WebhookId>, Refusal> {
        let Some(id) = id else { return Ok(None) };
        let found = self.0.store.records().webhook(&id).await?.is_some_and(|webhook| webhook.principal == *owner);
        if found { Ok(Some(id)) } else { Err(Refusal::UnknownWebhook { id }) }
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

    /// The config with the preset under it. What comes out is the job's own: it does not change when the preset does.
    async fn lay_over_preset(
        &self,
        owner: &Principal,
        config: Option<ConfigDocument>,
        preset: Option<String>,
    ) -> Result<(Option<ConfigDocument>, Option<VersionedName>), Refusal> {
        let Some(name) = preset else { return Ok((config, None)) };
        let kept = self.preset(owner, &name).await?;
        let bytes = config.as_ref().map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() });
        let text = engine::merge_config(&kept.document, bytes)?;
        let version = kept.own.map_or(0, |(version, _)| version);
        let config = ConfigDocument { file_name: "config.json".to_owned(), text };
        Ok((Some(config), Some(VersionedName { name, version })))
    }

    /// Asks for the same again.
    pub(super) async fn submit_again(&self, ended: JobRecord) -> Result<Submitted, Refusal> {
        let JobRecord { id, principal: owner, kind, request, input_bytes, priority, memory_bytes, .. } = ended;
        let retry_of = Some(id);
        // Who asks again for what is there wants it computed again.
        let request = JobRequest { skip_cache: true, ..request };
        let wanted = Wanted { owner, kind, request, input_bytes, memory_bytes, priority, retry_of, idempotency: None };
        self.enqueue(wanted).await
    }

    async fn enqueue(&self, wanted: Wanted) -> Result<Submitted, Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        let Wanted { owner, kind, request, input_bytes, memory_bytes, priority, retry_of, idempotency } = wanted;
        let (records, created_at) = (self.0.store.records(), self.0.clock.now());
        let inputs_sha256 = inputs_digest(&request);
        if let Some(until) = records.quarantined_until(&inputs_sha256, created_at).await? {
            return Err(Refusal::Quarantined { until });
        }
        let quota = self.quota(&owner).await?;
        if let Some(reached) = quota.filter(|quota| quota.unfinished >= quota.most) {
            Metric::AdmissionRejected.count([("reason", "quota".to_owned())], 1);
            return Err(Refusal::QuotaReached(reached));
        }
        self.0.store.blobs().check_room()?;
        let reservation = self.0.admission.reserve(records, input_bytes).await?;
        let record = JobRecord {
            id: JobId::new(),
            state: JobState::Queued,
            kind,
            request,
            input_bytes,
            attempt: 0,
            retry_of,
            created_at,
            started_at: None,
            finished_at: None,
            expires_at: None,
            warnings: 0,
            failure: None,
            principal: owner,
            priority,
            inputs_sha256,
            memory_bytes,
            crashes: 0,
            retries: 0,
            idempotency,
            lease: None,
            progress: None,
            trace_context: TraceContext::current().map(|context| context.to_string()),
            cache_key: None,
            cached_from: None,
        };
        Failpoint::BeforeJobRecord.reach();
        match records.add_job(&record).await? {
            Added::New => {}
            Added::FileMissing => {
                let (role, input) = self.first_missing(&record).await?;
                return Err(Refusal::UnknownInput { role, id: input.asset.to_string() });
            }
            // The same request came twice at the same time, and the other one was faster.
            Added::Before(before) => match &record.idempotency {
                Some(asked) => return self.repeated(*before, asked).await,
                None => return Err(Refusal::KeyReused { job: before.id }),
            },
        }
        Failpoint::AfterJobRecord.reach();
        reservation.fill();
        Metric::JobsSubmitted.count([], 1);
        self.0.changes.announce(&record.id, JobState::Queued);
        let job = self.snapshot(record, Vec::new()).await?;
        let quota = quota.map(|quota| JobQuota { unfinished: quota.unfinished + 1, ..quota });
        Ok(Submitted { job, is_repeated: false, quota })
    }

    async fn first_missing<'a>(&self, job: &'a JobRecord) -> Result<(InputRole, &'a JobInput), Refusal> {
        for (role, input) in job.request.inputs() {
            if self.0.store.records().asset(&job.principal, &input.asset).await?.is_none() {
                return Ok((role, input));
            }
        }
        Ok((InputRole::Source, &job.request.source))
    }
}

fn kind_of(request: &JobRequest) -> JobKind {
    let config = request.config.as_ref();
    let config = config.map(|config| NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() });
    JobKind::from_name(engine::task_of(config)).unwrap_or_default()
}

/// A digest of what files a job works on, and as what: the same for every job on the same files.
fn inputs_digest(request: &JobRequest) -> String {
    let names = request.inputs().map(|(role, input)| format!("{} {}\n", role.name(), input.sha256));
    library::digest(&names.collect::<String>())
}
