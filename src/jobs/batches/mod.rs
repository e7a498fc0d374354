//! Jobs that are asked for together: a batch.
//!
//! Every item of a batch is a job like any other, which runs, ends, is canceled and removed by itself; a batch only says which jobs belong
//! together. Its state and its counts follow from its jobs, so they cannot disagree with them. An item that cannot be run is a job that has
//! failed already. Jobs of batches wait behind those that were asked for one by one.

mod archive;
mod submission;

use std::{collections::BTreeMap, time::Duration};

use tokio::time::Instant;

pub use archive::ArchiveContents;
pub use submission::{BadItem, NewBatch, SubmittedBatch};

use super::{JobSnapshot, Jobs, Refusal, running::StopReason};
use crate::{
    store::{BatchId, BatchProgress, BatchRecord, JobFailure, JobState, JobVerdict, Page, Principal},
    telemetry::Metric,
};

/// How often a batch that somebody waits for is looked at, at most: every one of its jobs tells of several changes.
const LOOK_AT_AWAITED: Duration = Duration::from_millis(250);
/// How often to look although nothing was heard, in case another process has ended jobs of it.
const LOOK_AGAIN: Duration = Duration::from_secs(2);
/// How long to leave a batch that is being stopped to those who are just changing its jobs.
const LEAVE_TO_OTHERS: Duration = Duration::from_millis(5);

/// A batch as it is now.
#[derive(Clone, Debug)]
pub struct BatchSnapshot {
    /// The record.
    pub record: BatchRecord,
    /// What its jobs say.
    pub progress: BatchProgress,
}

impl BatchSnapshot {
    /// How many of its items are in that state.
    #[must_use]
    pub fn count(&self, state: JobState) -> u64 {
        self.progress.jobs.get(&state).copied().unwrap_or(0)
    }

    /// How many of its items have results with that verdict.
    #[must_use]
    pub fn judged(&self, verdict: JobVerdict) -> u64 {
        self.progress.verdicts.get(&verdict).copied().unwrap_or(0)
    }

    /// How many of its items have ended.
    #[must_use]
    pub fn ended(&self) -> u64 {
        JobState::ALL.into_iter().filter(|state| state.is_final()).map(|state| self.count(state)).sum()
    }

    /// The state of the whole: queued until one of its jobs starts, running until all have ended, then succeeded when all did, else failed
    /// when one did. Asking for failed items again leads back to the beginning.
    #[must_use]
    pub fn state(&self) -> JobState {
        let count = |state| self.count(state);
        match (count(JobState::Queued), count(JobState::Running), count(JobState::Canceling)) {
            (0, 0, 0) if count(JobState::Failed) > 0 => JobState::Failed,
            (0, 0, 0) if count(JobState::Canceled) > 0 => JobState::Canceled,
            (0, 0, 0) => JobState::Succeeded,
            (0, 0, _) => JobState::Canceling,
            // An item that could not be run has failed without any job having started.
            (_, 0, 0) if self.ended() == 0 || self.progress.started_at.is_none() => JobState::Queued,
            _ => JobState::Running,
        }
    }
}

impl Jobs {
    /// A batch as it is now.
    ///
    /// # Errors
    /// When its owner has none of that id, or none of its jobs is kept any more.
    pub async fn batch(&self, owner: &Principal, id: &BatchId) -> Result<BatchSnapshot, Refusal> {
        let records = self.0.store.records();
        let not_found = || Refusal::NotFound { kind: "batch", id: id.to_string() };
        let record = records.batch(owner, id).await?.ok_or_else(not_found)?;
        let progress = records.batch_progress(&[id]).await?.remove(id).ok_or_else(not_found)?;
        Ok(BatchSnapshot { record, progress })
    }

    /// Up to `most` batches of one owner, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn batches(
        &self,
        owner: &Principal,
        before: Option<&BatchId>,
        most: usize,
    ) -> Result<Page<BatchSnapshot>, Refusal> {
        let records = self.0.store.records();
        let page = records.batches(owner, before, most).await?;
        let ids: Vec<&BatchId> = page.items.iter().map(|record| &record.id).collect();
        let mut progress: BTreeMap<BatchId, BatchProgress> = records.batch_progress(&ids).await?;
        let snapshot = |record: BatchRecord| {
            let progress = progress.remove(&record.id).unwrap_or_default();
            BatchSnapshot { record, progress }
        };
        Ok(Page { items: page.items.into_iter().map(snapshot).collect(), has_more: page.has_more })
    }

    /// Up to `most` jobs of a batch in the order of its items, behind item `after`: the newest of each item, and only those in the state
    /// and with the verdict that are given.
    ///
    /// # Errors
    /// When its owner has no such batch.
    pub async fn batch_jobs(
        &self,
        owner: &Principal,
        id: &BatchId,
        filter: (Option<JobState>, Option<JobVerdict>),
        after: Option<u64>,
        most: usize,
    ) -> Result<Page<JobSnapshot>, Refusal> {
        self.batch(owner, id).await?;
        self.snapshots(self.0.store.records().batch_jobs(id, filter, after, most).await?).await
    }

    /// The batch when all its jobs have ended, or as it is when `longest` is over or the service is going down.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn wait_for_batch(
        &self,
        owner: &Principal,
        id: &BatchId,
        longest: Duration,
    ) -> Result<BatchSnapshot, Refusal> {
        // Listening begins before looking, so that no change is missed in between.
        let mut changes = self.0.changes.subscribe();
        let deadline = Instant::now() + longest;
        loop {
            let batch = self.batch(owner, id).await?;
            if batch.state().is_final() || self.is_draining() || Instant::now() >= deadline {
                return Ok(batch);
            }
            let looked = Instant::now();
            let changed = async {
                // Falling behind may have hidden an end, so it counts as one.
                while matches!(changes.recv().await, Ok(change) if !change.is_end() && !self.is_draining()) {}
            };
            let _ = tokio::time::timeout_at(deadline.min(looked + LOOK_AGAIN), changed).await;
            tokio::time::sleep_until(deadline.min(looked + LOOK_AT_AWAITED)).await;
        }
    }

    /// Stops a batch: what waits ends, what runs is told to stop, what has ended stays as it is. Never refused for load.
    ///
    /// # Errors
    /// When its owner has none of that id.
    pub async fn cancel_batch(&self, owner: &Principal, id: &BatchId) -> Result<BatchSnapshot, Refusal> {
        self.batch(owner, id).await?;
        loop {
            let end = self.ending(JobState::Canceled, None);
            let stopped = self.0.store.records().stop_batch(id, &end).await?;
            // The state comes first: a worker that stops looks there for what to write.
            for job in &stopped.stopping {
                self.0.running.stop(job, StopReason::Canceled);
            }
            self.announce_stopped(stopped.ended, None);
            if !stopped.has_more {
                return self.batch(owner, id).await;
            }
            tokio::time::sleep(LEAVE_TO_OTHERS).await;
        }
    }

    /// Counts jobs that ended together before they had started, and tells those who wait.
    pub(super) fn announce_stopped(&self, count: u64, failure: Option<&JobFailure>) {
        if count > 0 {
            let code = failure.map_or_else(String::new, |failure| failure.code.clone());
            Metric::JobsFinished.count([("state", JobState::Canceled.name().to_owned()), ("code", code)], count);
            self.0.changes.announce_anything();
        }
    }
}
