//! What is kept of a batch beside its jobs, and what its jobs say of it.

use std::collections::BTreeMap;

use jiff::Timestamp;

use super::{Idempotency, JobState, JobVerdict};
use crate::store::{BatchId, JobId, Principal};

named! {
    /// What a failure does to the jobs of the same batch that wait.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
    pub enum OnError {
        /// Nothing.
        #[default]
        Continue = "continue",
        /// They do not start any more.
        Stop = "stop",
    }
}

/// Jobs that were asked for together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchRecord {
    /// Its name.
    pub id: BatchId,
    /// Who asked for it.
    pub principal: Principal,
    /// When.
    pub created_at: Timestamp,
    /// What a failure does to the jobs that wait.
    pub on_error: OnError,
    /// How many items there are; each has one job, and an older one for every time that it was asked for again.
    pub items: u64,
    /// The user's own words about it.
    pub labels: BTreeMap<String, String>,
    /// With what it was asked for, so that asking again gives the same batch.
    pub idempotency: Option<Idempotency>,
}

/// What the jobs of a batch say of it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct BatchProgress {
    /// The newest job of each item, counted by state; states without jobs are not there.
    pub jobs: BTreeMap<JobState, u64>,
    /// The newest job of each item that has results, counted by verdict; verdicts without jobs are not there.
    pub verdicts: BTreeMap<JobVerdict, u64>,
    /// How often items were asked for again.
    pub retried: u64,
    /// When the first of them started.
    pub started_at: Option<Timestamp>,
    /// When the last of them ended that has ended.
    pub finished_at: Option<Timestamp>,
    /// When the last of them may be removed that has ended.
    pub expires_at: Option<Timestamp>,
}

/// How adding a batch went.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AddedBatch {
    /// It is there now, with all its jobs.
    New,
    /// Nothing was written: a file of a job that would wait is no longer there.
    FileMissing,
    /// Nothing was written: this one is there already, asked for with the same key.
    Before(Box<BatchRecord>),
}

/// How asking for items again went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AddedAgain {
    /// The new jobs are there.
    New,
    /// Nothing was written: a file of a job that would wait is no longer there.
    FileMissing,
    /// Nothing was written: somebody else has asked for some of them again.
    Outrun,
}

/// What stopping a batch did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct StoppedBatch {
    /// How many jobs waited and have ended.
    pub ended: u64,
    /// Those that ran and were told to stop.
    pub stopping: Vec<JobId>,
    /// Whether some were just changing hands, so that the batch is to be stopped once more.
    pub has_more: bool,
}
