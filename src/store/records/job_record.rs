//! What is kept of a job. Everything in it is plain data, so that any process can run it.

use std::{collections::BTreeMap, sync::Arc};

use jiff::Timestamp;
use serde::{Deserialize, Deserializer, Serialize};

use crate::store::{AssetId, BatchId, JobId, Judgment, LeaseId, Principal, ResultRecord, WebhookId};

named! {
    /// Where a job is in its life.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum JobState {
        /// Waits for a worker.
        Queued = "queued",
        /// A worker has it.
        Running = "running",
        /// A worker has it and was told to stop.
        Canceling = "canceling",
        /// Its results are there.
        Succeeded = "succeeded",
        /// It ended without results.
        Failed = "failed",
        /// It was stopped on request.
        Canceled = "canceled",
    }
}

impl JobState {
    /// Whether it never changes again.
    #[must_use]
    pub const fn is_final(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Canceled)
    }
}

named! {
    /// What a job does.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
    pub enum JobKind {
        /// Puts a clip onto a character.
        #[default]
        Retarget = "retarget",
        /// Edits a clip.
        Edit = "edit",
        /// Puts a character into a pose.
        Pose = "pose",
        /// Lets a drawing move.
        Draw = "draw",
    }
}

/// What a job does, with what its files and its config do not say.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum JobTask {
    /// Puts a clip onto a character.
    #[default]
    Retarget,
    /// Edits a clip.
    Edit,
    /// Puts a character into a pose.
    Pose {
        /// The wire name of the pose; nothing where the config names it.
        to: Option<String>,
    },
    /// Lets a drawing, which is the target, move.
    Draw,
}

impl JobTask {
    /// What a config of that kind asks for.
    #[must_use]
    pub const fn of_kind(kind: JobKind) -> Self {
        match kind {
            JobKind::Retarget => Self::Retarget,
            JobKind::Edit => Self::Edit,
            JobKind::Pose => Self::Pose { to: None },
            JobKind::Draw => Self::Draw,
        }
    }

    /// What kind of job it is.
    #[must_use]
    pub const fn kind(&self) -> JobKind {
        match self {
            Self::Retarget => JobKind::Retarget,
            Self::Edit => JobKind::Edit,
            Self::Pose { .. } => JobKind::Pose,
            Self::Draw => JobKind::Draw,
        }
    }

    /// The files that it cannot do without.
    #[must_use]
    pub fn needs(&self) -> &'static [InputRole] {
        match self {
            Self::Retarget => &[InputRole::Source, InputRole::Target],
            Self::Edit => &[InputRole::Source],
            Self::Pose { to: Some(to) } if to == "source" => &[InputRole::Target, InputRole::Source],
            Self::Pose { .. } | Self::Draw => &[InputRole::Target],
        }
    }
}

named! {
    /// What a file is to a job.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
    #[serde(rename_all = "snake_case")]
    pub enum InputRole {
        /// The file with the animation.
        Source = "source",
        /// The file with the character.
        Target = "target",
        /// The source rig in its rest pose.
        SourceRest = "source_rest",
        /// The target rig in its rest pose.
        TargetRest = "target_rest",
        /// What goes beside a drawing: configs of *Animated Drawings* and a background, in an archive.
        Scene = "scene",
    }
}

/// A file that a job works on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobInput {
    /// The asset.
    pub asset: AssetId,
    /// Its digest, which together with the config says what the job computes.
    pub sha256: String,
    /// Its file name.
    pub file_name: String,
}

/// The retarget config as it came.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ConfigDocument {
    /// Its file name; the ending may tell formats apart.
    pub file_name: String,
    /// Its text, shared by all items of a batch that have the same.
    #[serde(with = "shared_text")]
    pub text: Arc<str>,
}

/// A shared text, written as any other.
mod shared_text {
    use std::sync::Arc;

    use serde::{Deserialize, Deserializer, Serializer};

    pub(super) fn serialize<S: Serializer>(text: &Arc<str>, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(text)
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<str>, D::Error> {
        String::deserialize(deserializer).map(Arc::from)
    }
}

/// What was asked for.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobRequest {
    /// What is to be done.
    #[serde(default)]
    pub task: JobTask,
    /// The files, by what they are to it; at least those that the task needs.
    #[serde(flatten, deserialize_with = "given_inputs")]
    pub inputs: BTreeMap<InputRole, JobInput>,
    /// The retarget config.
    pub config: Option<ConfigDocument>,
    /// Wire names of the formats asked for. Empty: what the config says.
    pub formats: Vec<String>,
    /// The user's own words about it.
    pub labels: BTreeMap<String, String>,
    /// The preset that is in the config already.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub preset: Option<VersionedName>,
    /// The rig templates of the user's own that it is recognized with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rigs: Vec<VersionedName>,
    /// What its results are called, without their endings, where that is not to follow from its files: in a batch, no two are the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result_name: Option<String>,
    /// Whether it is to be run although its results may be there already.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub skip_cache: bool,
    /// The webhook that is told of its end, whatever that listens to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub webhook: Option<WebhookId>,
}

/// One version of a document that is kept under a name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct VersionedName {
    /// What it is called.
    pub name: String,
    /// Its version, from 1; 0 for what comes with the program.
    pub version: u64,
}

/// Inputs of which some may be written as `null`.
fn given_inputs<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<InputRole, JobInput>, D::Error> {
    let inputs = BTreeMap::<InputRole, Option<JobInput>>::deserialize(deserializer)?;
    Ok(inputs.into_iter().filter_map(|(role, input)| Some((role, input?))).collect())
}

/// Why a job has no results.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct JobFailure {
    /// Stable code: one of the engine's, or `job_timeout`, `worker_crashed`.
    pub code: String,
    /// What is wrong.
    pub detail: String,
    /// Which input. May be empty.
    pub part: String,
    /// Where in it. May be empty.
    pub place: String,
    /// What the user can do. May be empty.
    pub hint: String,
    /// Every single thing that is wrong.
    pub errors: Vec<StoredFieldError>,
}

/// One thing that is wrong with a document.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredFieldError {
    /// JSON pointer.
    pub pointer: String,
    /// Stable code.
    pub code: String,
    /// What is wrong.
    pub detail: String,
    /// Names that look like the one that was seen.
    pub did_you_mean: Vec<String>,
}

/// A job.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRecord {
    /// Its name.
    pub id: JobId,
    /// Where it is in its life.
    pub state: JobState,
    /// What was asked for.
    pub request: JobRequest,
    /// Bytes of its input files.
    pub input_bytes: u64,
    /// How often it was started.
    pub attempt: u32,
    /// The job that it repeats.
    pub retry_of: Option<JobId>,
    /// When it was asked for.
    pub created_at: Timestamp,
    /// When it last started.
    pub started_at: Option<Timestamp>,
    /// When it reached its final state.
    pub finished_at: Option<Timestamp>,
    /// When it may be removed; not known before it has ended.
    pub expires_at: Option<Timestamp>,
    /// How many warnings its report has.
    pub warnings: u64,
    /// What its report says of its result as a whole.
    pub judgment: Option<Judgment>,
    /// Why it has no results.
    pub failure: Option<JobFailure>,
    /// Who asked for it.
    pub principal: Principal,
    /// Among the jobs of one principal, the greater goes first.
    pub priority: i32,
    /// SHA-256 of what it is and of the digests of its input files: the same for every job on the same files.
    pub inputs_sha256: String,
    /// How much memory it is thought to need while it runs.
    pub memory_bytes: u64,
    /// How often the process died under it.
    pub crashes: u32,
    /// How often it was put back because the store had failed.
    pub retries: u32,
    /// With what it was asked for, so that asking again gives the same job.
    pub idempotency: Option<Idempotency>,
    /// Who has it, or who had it when it ended.
    pub lease: Option<LeaseId>,
    /// How far it was when its worker last said so.
    pub progress: Option<StoredProgress>,
    /// The span that asked for it, as `telemetry::TraceContext` writes it, so that those who work on it belong to the same trace.
    pub trace_context: Option<String>,
    /// A digest of what it computed, where others may be given its results.
    pub cache_key: Option<String>,
    /// The job whose results it was given.
    pub cached_from: Option<JobId>,
    /// The batch that it was asked for with.
    pub batch: Option<BatchPlace>,
}

impl JobRecord {
    /// The record of a job that waited, after an end without results was written.
    #[must_use]
    pub fn ended_without_results(self, end: &FinishedJob) -> Self {
        Self {
            state: end.state,
            finished_at: Some(end.finished_at),
            expires_at: Some(end.expires_at),
            failure: end.failure.clone(),
            ..self
        }
    }

    /// What kind of job it is.
    #[must_use]
    pub const fn kind(&self) -> JobKind {
        self.request.task.kind()
    }

    /// Among which jobs it waits.
    #[must_use]
    pub const fn lane(&self) -> Lane {
        match self.batch {
            None => Lane::Single,
            Some(_) => Lane::Batch,
        }
    }
}

/// Where a job belongs that was asked for with others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchPlace {
    /// The batch.
    pub batch: BatchId,
    /// Which of its items the job is for, from 0.
    pub item: u64,
}

/// A job that a worker has, as the worker reports it.
#[derive(Clone, Debug)]
pub struct Held {
    /// The job.
    pub id: JobId,
    /// The worker's hold on it.
    pub lease: LeaseId,
    /// How far it is.
    pub progress: StoredProgress,
}

/// Which jobs are taken up: a job of a batch waits behind those that its caller asked for one by one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Lane {
    /// Asked for by themselves.
    Single,
    /// Asked for with others.
    Batch,
}

impl Lane {
    /// As the database orders them.
    pub(super) const fn number(self) -> i64 {
        match self {
            Self::Single => 0,
            Self::Batch => 1,
        }
    }
}

/// What tells a request that comes again from another one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Idempotency {
    /// The caller's word for the request; each principal has its own.
    pub key: String,
    /// SHA-256 of what was asked for: the same word for something else is a mistake.
    pub asked_sha256: String,
}

/// How adding a job went.
#[derive(Clone, Debug, PartialEq)]
pub enum Added {
    /// It is there now.
    New,
    /// Nothing was written: one of its files is no longer there.
    FileMissing,
    /// Nothing was written: this one is there already, of the same id or asked for with the same key.
    Before(Box<JobRecord>),
}

/// How far a job is, as its worker last said.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StoredProgress {
    /// The wire name of the phase.
    pub phase: String,
    /// Units done in it.
    pub done: u64,
    /// Units of it; 0 where unknown.
    pub total: u64,
}

/// How writing the end of a job went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// It is written.
    Written {
        /// Jobs of the same batch that waited and ended with it.
        stopped: u64,
    },
    /// Nothing was written: the job is in another state or in other hands.
    Elsewhere,
}

impl Ended {
    /// Whether it is written.
    #[must_use]
    pub const fn is_written(self) -> bool {
        matches!(self, Self::Written { .. })
    }
}

/// What is written when a job ends.
#[derive(Clone, Debug)]
pub struct FinishedJob {
    /// The final state.
    pub state: JobState,
    /// When.
    pub finished_at: Timestamp,
    /// When the record may be removed.
    pub expires_at: Timestamp,
    /// Why there are no results.
    pub failure: Option<JobFailure>,
    /// What the jobs of its batch end with that wait, where the batch is to stop at the first failure and this is one.
    pub stops_batch: Option<JobFailure>,
    /// The report, as JSON.
    pub report: Option<String>,
    /// The resolved spec, as JSON.
    pub resolved_spec: Option<String>,
    /// How many warnings the report has.
    pub warnings: u64,
    /// What the report says of the result as a whole.
    pub judgment: Option<Judgment>,
    /// The files.
    pub results: Vec<ResultRecord>,
    /// A digest of what was computed, where others may be given the results.
    pub cache_key: Option<String>,
    /// The job whose results these are.
    pub cached_from: Option<JobId>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_request_is_read_as_it_was_written_now_and_before_there_were_tasks() {
        let input = |name: &str| serde_json::json!({"asset": "ast_01j9z3k8m0q4r6t8v0x2y4a6c8", "sha256": "aa", "file_name": name});
        let before = serde_json::json!({"source": input("walk.bvh"), "target": input("hero.glb"), "source_rest": null,
            "target_rest": null, "config": null, "formats": ["glb"], "labels": {}});
        let mut request: JobRequest = serde_json::from_value(before).expect("a request");
        assert_eq!(request.task, JobTask::Retarget, "what its kind says is for who has that");
        let roles: Vec<InputRole> = request.inputs.keys().copied().collect();
        assert_eq!(roles, [InputRole::Source, InputRole::Target], "no file is no file");
        request.task = JobTask::Pose { to: Some("a".to_owned()) };
        request.inputs.remove(&InputRole::Source);
        let written = serde_json::to_string(&request).expect("JSON");
        assert_eq!(serde_json::from_str::<JobRequest>(&written).expect("a request"), request, "{written}");
    }
}
