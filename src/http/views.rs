//! What resources look like on the wire. Apart from the records, so that neither binds the other.

use std::collections::BTreeMap;

use serde::Serialize;
use utoipa::ToSchema;

use super::{
    caching,
    problem::{Problem, ProblemView},
};
use crate::{
    engine::is_drawable,
    jobs::{AssetRecord, JobInput, JobRecord, JobRequest, JobSnapshot, ResultRecord, StoredProgress, VersionedName},
};

/// An uploaded file.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Asset)]
pub(super) struct AssetView {
    /// Names it in jobs.
    #[schema(example = "ast_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    id: String,
    /// What it was called.
    file_name: String,
    /// Wire name of its format, found from its bytes.
    #[schema(example = "bvh")]
    format: String,
    /// Its size in bytes.
    bytes: u64,
    /// SHA-256 of its bytes, in hexadecimal.
    sha256: String,
    /// When it came.
    #[schema(format = DateTime)]
    created_at: String,
    /// When it may be removed. Uploading the same bytes again moves it.
    #[schema(format = DateTime)]
    expires_at: String,
    /// Where its bytes are.
    content: String,
    /// Where to see what it holds.
    skeleton: String,
    /// Where to see what it looks like.
    thumbnail: String,
}

impl From<AssetRecord> for AssetView {
    fn from(asset: AssetRecord) -> Self {
        Self {
            content: format!("/v1/assets/{}/content", asset.id),
            skeleton: format!("/v1/assets/{}/skeleton", asset.id),
            thumbnail: format!("/v1/assets/{}/preview.png?size=256", asset.id),
            id: asset.id.to_string(),
            file_name: asset.file_name,
            format: asset.format,
            bytes: asset.bytes,
            sha256: asset.sha256,
            created_at: asset.created_at.to_string(),
            expires_at: asset.expires_at.to_string(),
        }
    }
}

/// A page of assets, newest first.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = AssetPage)]
pub(super) struct AssetPageView {
    /// The assets.
    pub(super) items: Vec<AssetView>,
    /// To be given as `cursor` for the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) next_cursor: Option<String>,
}

/// A file that a job gave.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Result)]
pub(super) struct ResultView {
    /// Names it.
    #[schema(example = "res_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    id: String,
    /// The job that gave it.
    job: String,
    /// Wire name of its format.
    #[schema(example = "glb")]
    format: String,
    /// A name to save it under.
    file_name: String,
    /// Its size in bytes.
    bytes: u64,
    /// SHA-256 of its bytes, in hexadecimal; also its `ETag`.
    sha256: String,
    /// When it was made.
    #[schema(format = DateTime)]
    created_at: String,
    /// When it may be removed.
    #[schema(format = DateTime)]
    expires_at: String,
    /// Where its bytes are.
    content: String,
    /// Where to see what it looks like; not of what is a picture itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    thumbnail: Option<String>,
}

impl From<ResultRecord> for ResultView {
    fn from(result: ResultRecord) -> Self {
        Self {
            content: format!("/v1/results/{}/content", result.id),
            thumbnail: is_drawable(&result.format).then(|| format!("/v1/results/{}/preview.png?size=256", result.id)),
            id: result.id.to_string(),
            job: result.job_id.to_string(),
            format: result.format,
            file_name: result.file_name,
            bytes: result.bytes,
            sha256: result.sha256,
            created_at: result.created_at.to_string(),
            expires_at: result.expires_at.to_string(),
        }
    }
}

/// A job.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Job)]
pub(super) struct JobView {
    /// Names it.
    #[schema(example = "job_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    id: String,
    /// `queued`, `running`, `canceling`, `succeeded`, `failed` or `canceled`; the last three never change.
    #[schema(example = "running")]
    state: &'static str,
    /// `retarget`, `edit`, `pose` or `draw`.
    #[schema(example = "retarget")]
    kind: &'static str,
    /// Its place in the queue, from 1, while it waits. Lists leave it out.
    #[serde(skip_serializing_if = "Option::is_none")]
    queue_position: Option<u64>,
    /// How far it is, while it runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    progress: Option<ProgressView>,
    /// How often it was started.
    attempt: u32,
    /// When it was asked for.
    #[schema(format = DateTime)]
    created_at: String,
    /// When it was last started.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    started_at: Option<String>,
    /// When it reached its final state.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    finished_at: Option<String>,
    /// When its record may be removed; known when it has ended.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(format = DateTime)]
    expires_at: Option<String>,
    /// What it works on.
    inputs: BTreeMap<&'static str, JobInputView>,
    /// The formats asked for; empty when the config says.
    output: Vec<String>,
    /// The user's own words about it.
    labels: BTreeMap<String, String>,
    /// The preset that its config was laid over.
    #[serde(skip_serializing_if = "Option::is_none")]
    preset: Option<VersionedNameView>,
    /// The rig templates of the user's own that it is recognized with, in the versions of when it was asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    rigs: Vec<VersionedNameView>,
    /// The batch that it was asked for with.
    #[serde(skip_serializing_if = "Option::is_none")]
    batch: Option<String>,
    /// Which item of the batch it is for, from 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    batch_item: Option<u64>,
    /// The webhook that is told of its end, where it names one.
    #[serde(skip_serializing_if = "Option::is_none")]
    webhook: Option<String>,
    /// The job that it repeats.
    #[serde(skip_serializing_if = "Option::is_none")]
    retry_of: Option<String>,
    /// `hit` where another job of yours had computed the same and its results were taken, `miss` where this one computed them; absent
    /// without results, or where the service does not look.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "miss")]
    cache: Option<&'static str>,
    /// The job whose results were taken.
    #[serde(skip_serializing_if = "Option::is_none")]
    cached_from: Option<String>,
    /// The files that it gave.
    results: Vec<ResultView>,
    /// Where to see what it gave: the first of its results that can be drawn.
    #[serde(skip_serializing_if = "Option::is_none")]
    thumbnail: Option<String>,
    /// How many warnings its report has.
    warnings_count: u64,
    /// What its report says of the result as a whole: `pass`, `warn`, `fail`, or `not_applicable` where nothing could be measured; absent
    /// without a report or without measures.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(example = "pass")]
    verdict: Option<&'static str>,
    /// What the verdict is about, for people: the metric, its value, and the frame and joint where it is worst.
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict_reason: Option<String>,
    /// The share of the target's body that is driven, from 0 to 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    coverage: Option<f64>,
    /// Why it has no results.
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<ProblemView>,
    /// Where to go from here.
    links: JobLinks,
}

/// A file that a job works on.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = JobInput)]
pub(super) struct JobInputView {
    /// The asset.
    asset: String,
    /// SHA-256 of its bytes, in hexadecimal; empty where an item of a batch names an asset that is not there.
    sha256: String,
    /// What it was called.
    file_name: String,
}

/// One version of a rig or preset.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = VersionedName)]
pub(super) struct VersionedNameView {
    /// What it is called.
    #[schema(example = "our_hero")]
    name: String,
    /// Its version, from 1; 0 for what comes with the program.
    version: u64,
}

impl From<VersionedName> for VersionedNameView {
    fn from(named: VersionedName) -> Self {
        Self { name: named.name, version: named.version }
    }
}

/// How far a job is.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = Progress)]
pub(super) struct ProgressView {
    /// `waiting`, `read`, `plan`, `retarget` or `write`.
    phase: String,
    /// Units done in this phase; frames while retargeting.
    done: u64,
    /// Units of this phase; 0 where unknown.
    total: u64,
}

impl From<StoredProgress> for ProgressView {
    fn from(progress: StoredProgress) -> Self {
        let StoredProgress { phase, done, total } = progress;
        Self { phase, done, total }
    }
}

/// Where to go from a job.
#[derive(Debug, Serialize, ToSchema)]
pub(super) struct JobLinks {
    /// The job itself.
    #[serde(rename = "self")]
    own: String,
    /// To stop it.
    #[serde(skip_serializing_if = "Option::is_none")]
    cancel: Option<String>,
    /// To ask for the same again.
    #[serde(skip_serializing_if = "Option::is_none")]
    retry: Option<String>,
    /// To follow it.
    events: String,
    /// What was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    report: Option<String>,
    /// The spec with everything found out filled in.
    #[serde(skip_serializing_if = "Option::is_none")]
    config: Option<String>,
}

impl JobLinks {
    fn of(record: &JobRecord) -> Self {
        let own = format!("/v1/jobs/{}", record.id);
        let (has_ended, has_report) = (record.state.is_final(), record.state == crate::jobs::JobState::Succeeded);
        let link = |there: bool, name: &str| there.then(|| format!("{own}/{name}"));
        Self {
            cancel: link(!has_ended, "cancel"),
            retry: link(has_ended, "retry"),
            report: link(has_report, "report"),
            config: link(has_report, "config"),
            events: format!("{own}/events"),
            own,
        }
    }
}

impl From<JobSnapshot> for JobView {
    fn from(snapshot: JobSnapshot) -> Self {
        let JobSnapshot { record, results, queue_position, progress } = snapshot;
        let links = JobLinks::of(&record);
        let inputs = inputs_view(&record.request);
        let problem = record.failure.as_ref().map(|failure| Problem::of_job(failure).view(&links.own, ""));
        let cache = caching::word(&record);
        let results: Vec<ResultView> = results.into_iter().map(ResultView::from).collect();
        Self {
            id: record.id.to_string(),
            state: record.state.name(),
            kind: record.kind().name(),
            queue_position,
            progress: progress.map(ProgressView::from),
            attempt: record.attempt,
            created_at: record.created_at.to_string(),
            started_at: record.started_at.map(|time| time.to_string()),
            finished_at: record.finished_at.map(|time| time.to_string()),
            expires_at: record.expires_at.map(|time| time.to_string()),
            inputs,
            output: record.request.formats,
            labels: record.request.labels,
            preset: record.request.preset.map(VersionedNameView::from),
            rigs: record.request.rigs.into_iter().map(VersionedNameView::from).collect(),
            batch: record.batch.as_ref().map(|place| place.batch.to_string()),
            batch_item: record.batch.as_ref().map(|place| place.item),
            webhook: record.request.webhook.map(|id| id.to_string()),
            retry_of: record.retry_of.map(|id| id.to_string()),
            cache,
            cached_from: record.cached_from.map(|id| id.to_string()),
            thumbnail: results.iter().find_map(|result| result.thumbnail.clone()),
            results,
            warnings_count: record.warnings,
            verdict: record.judgment.as_ref().map(|judgment| judgment.verdict.name()),
            coverage: record.judgment.as_ref().and_then(|judgment| judgment.coverage),
            verdict_reason: record.judgment.map(|judgment| judgment.reason),
            problem,
            links,
        }
    }
}

/// The files of a job by what they are to it.
pub(super) fn inputs_view(request: &JobRequest) -> BTreeMap<&'static str, JobInputView> {
    request.inputs.iter().map(|(role, input)| (role.name(), JobInputView::from(input))).collect()
}

impl From<&JobInput> for JobInputView {
    fn from(input: &JobInput) -> Self {
        Self { asset: input.asset.to_string(), sha256: input.sha256.clone(), file_name: input.file_name.clone() }
    }
}

/// A page of jobs, newest first.
#[derive(Debug, Serialize, ToSchema)]
#[schema(as = JobPage)]
pub(super) struct JobPageView {
    /// The jobs.
    pub(super) items: Vec<JobView>,
    /// To be given as `cursor` for the next page; absent on the last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) next_cursor: Option<String>,
}
