//! Why a request to the service half is not carried out.

use crate::{
    engine::Failure,
    outbound::Blocked,
    store::{InputRole, JobFailure, JobId, JobState, Principal, StoreError, WebhookId},
};

/// How many unfinished jobs a principal may have, and has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JobQuota {
    /// The setting `max_principal_jobs`.
    pub most: u64,
    /// How many there are. What is asked for in the same moment may exceed the quota by as much.
    pub unfinished: u64,
}

/// Why a request is not carried out. The door that the request came through puts it into its own words.
#[derive(Debug, thiserror::Error)]
pub enum Refusal {
    /// Nothing has that id.
    #[error("there is no {kind} '{id}'{}", why_gone(kind))]
    NotFound {
        /// What was looked for: `asset`, `job`, `result`.
        kind: &'static str,
        /// The id.
        id: String,
    },
    /// It was there until its time was over.
    #[error("the {kind} '{id}' has expired")]
    Expired {
        /// What was looked for.
        kind: &'static str,
        /// The id.
        id: String,
    },
    /// A job names a file that is not there.
    #[error("no asset has the id '{id}', which is given as {}; it may have expired", role.name())]
    UnknownInput {
        /// What it was to be to the job.
        role: InputRole,
        /// The id.
        id: String,
    },
    /// The queue takes no more.
    #[error("the queue is full: {actual} of at most {most} {limit}")]
    QueueFull {
        /// The limit that is reached.
        limit: &'static str,
        /// Its value.
        most: u64,
        /// What there would be.
        actual: u64,
    },
    /// The maximum number of unfinished jobs is reached, or would have more.
    #[error("the caller already has {} unfinished jobs", quota.unfinished)]
    QuotaReached {
        /// How many there may be, and are.
        quota: JobQuota,
        /// How many more were asked for.
        asked: u64,
    },
    /// The caller has as many event streams open as may be.
    #[error("{most} event streams are already open")]
    TooManyStreams {
        /// How many that is.
        most: u64,
    },
    /// More than a limit allows.
    #[error("{what} is larger than the limit '{limit}' of {most} allows")]
    TooLarge {
        /// What is too large.
        what: String,
        /// The limit.
        limit: &'static str,
        /// Its value.
        most: u64,
        /// What was seen, as far as it is known.
        actual: u64,
    },
    /// The digest does not match the bytes.
    #[error("the bytes have the SHA-256 {actual}, but the request announced {announced}")]
    DigestMismatch {
        /// What was announced, in hexadecimal.
        announced: String,
        /// What arrived, in hexadecimal.
        actual: String,
    },
    /// It was nobody's turn for too long.
    #[error("too many files are being inspected at the same time")]
    TooBusy,
    /// The service is going down.
    #[error("the service is shutting down and accepts no new work")]
    Draining,
    /// There is no room for what would be stored.
    #[error("there is no room for more files: {0}")]
    StorageFull(Full),
    /// The job is in a state that does not allow it.
    #[error("the job '{id}' is {}, so {action}", state.name())]
    WrongState {
        /// The job.
        id: JobId,
        /// Its state.
        state: JobState,
        /// What follows from that.
        action: &'static str,
    },
    /// Processes died under jobs on the same files, again and again.
    #[error("jobs on these files have crashed workers several times, so they are refused until {until}")]
    Quarantined {
        /// When they are taken again.
        until: jiff::Timestamp,
    },
    /// An unfinished job needs the file.
    #[error("the file is an input of the unfinished job '{0}'")]
    InUse(JobId),
    /// It comes with the program and cannot be changed.
    #[error("the {kind} '{name}' is built in and cannot be changed")]
    BuiltIn {
        /// `rig` or `preset`.
        kind: &'static str,
        /// Its name.
        name: String,
    },
    /// It is not what the caller takes it for.
    #[error("the {kind} '{name}' does not meet the precondition: {}", seen(current.as_deref()))]
    Changed {
        /// `rig` or `preset`.
        kind: &'static str,
        /// Its name.
        name: String,
        /// The digest of what is there.
        current: Option<String>,
    },
    /// As many as may be are kept already.
    #[error("no more {kind}s can be stored: the limit '{limit}' is {most}")]
    TooManyDocuments {
        /// `rig` or `preset`.
        kind: &'static str,
        /// The name of the limit.
        limit: &'static str,
        /// The limit.
        most: u64,
    },
    /// The records of the caller, or of all, have reached a limit, and none has ended that could go.
    #[error("no more records can be stored: there are {actual}, and the limit '{limit}' is {most}")]
    TooManyRecords {
        /// The name of the limit.
        limit: &'static str,
        /// Its value.
        most: u64,
        /// What there is.
        actual: u64,
    },
    /// The principal has as many keys as may be good at the same time.
    #[error("'{principal}' already has {most} keys")]
    TooManyKeys {
        /// Who has them.
        principal: Principal,
        /// How many that is.
        most: u64,
    },
    /// An idempotency key came before, with something else.
    #[error("the same 'Idempotency-Key' was used for another request, which created the {kind} '{id}'")]
    KeyReused {
        /// `job` or `batch`.
        kind: &'static str,
        /// Its id.
        id: String,
    },
    /// An item of a batch cannot be run, and all or none were asked for.
    #[error("item {item} cannot be run: {}", failure.detail)]
    BadItem {
        /// Which one, from 0.
        item: u64,
        /// Why.
        failure: Box<JobFailure>,
    },
    /// A job names a preset that is not there.
    #[error("there is no preset '{name}'")]
    UnknownPreset {
        /// The name.
        name: String,
        /// Those that there are.
        known: Vec<String>,
    },
    /// A URL leads where the service does not go.
    #[error("the URL cannot be used: {0}")]
    ForbiddenUrl(Blocked),
    /// The operator has not let the service fetch files.
    #[error("this service does not fetch files by URL")]
    UrlInputOff,
    /// A file that was to be fetched did not arrive.
    #[error("the file cannot be fetched: {reason}")]
    FetchFailed {
        /// What became of it.
        reason: String,
    },
    /// The principal has as many webhooks as may be.
    #[error("there are already {most} webhooks")]
    TooManyWebhooks {
        /// How many that is.
        most: u64,
    },
    /// A job names a webhook that is not there.
    #[error("there is no webhook '{id}'")]
    UnknownWebhook {
        /// Its id.
        id: WebhookId,
    },
    /// The webhook is told nothing.
    #[error("the webhook '{id}' is disabled")]
    WebhookDisabled {
        /// Its id.
        id: WebhookId,
    },
    /// The engine refused a file.
    #[error(transparent)]
    Engine(#[from] Failure),
    /// The store failed.
    #[error(transparent)]
    Store(StoreError),
}

/// What is full.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Full {
    /// The disk.
    #[error("the disk is full")]
    Disk,
    /// All of it that the operator lets files have.
    #[error("the disk has {free_bytes} bytes left, and the setting 'reserved_disk' keeps {reserved_bytes}")]
    Reserve {
        /// What is left.
        free_bytes: u64,
        /// What is to be left.
        reserved_bytes: u64,
    },
    /// What may be stored of all callers.
    #[error("with this file {actual} bytes would be stored, and the limit 'stored_bytes' is {most}")]
    StoredBytes {
        /// The limit.
        most: u64,
        /// What there would be.
        actual: u64,
    },
}

/// Files, jobs and what comes of them have a time; the rest stays until somebody removes it.
fn why_gone(kind: &str) -> &'static str {
    match kind {
        "rig" | "preset" | "key" | "webhook" => "",
        _ => "; it may have been deleted, or it expired and was removed",
    }
}

fn seen(current: Option<&str>) -> String {
    current.map_or_else(|| "there is none".to_owned(), |current| format!("its ETag is \"{current}\""))
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::InUse(job) => Self::InUse(job),
            StoreError::NoRoom { free_bytes, reserved_bytes, .. } => {
                Self::StorageFull(Full::Reserve { free_bytes, reserved_bytes })
            }
            error if error.is_storage_full() => Self::StorageFull(Full::Disk),
            error => Self::Store(error),
        }
    }
}
