//! Waiting for the file of a job, from before the job is in the store.

use std::{sync::Arc, time::Duration};

use bytes::Bytes;
use tokio::sync::broadcast;

use super::{
    handover::{Given, HandedFile, Wanting},
    head_start::{Begun, HeadStart},
};
use crate::{
    engine::Timings,
    jobs::{JobSnapshot, Jobs, Refusal, changes::Change, engine::InputBytes, library, running::new_control},
    store::{FinishedJob, JobId, JobRecord, JobState, Principal},
};

/// What came of waiting for a job.
#[derive(Debug)]
pub enum Awaited {
    /// Its file.
    File(Box<HandedFile>),
    /// The job as it is when it has ended elsewhere or otherwise, or when it takes longer.
    Job(Box<JobSnapshot>),
}

/// Waiting for the file of a job. Dropping it stops work on the job that no worker has taken over.
#[derive(Debug)]
pub struct Awaiting {
    file: Option<Wanting>,
    /// What became of the job from its beginning; nothing where it may have begun, or ended, before.
    changes: Option<broadcast::Receiver<Change>>,
    _begun: Option<Begun>,
}

impl Awaiting {
    /// For a job that is in the store already.
    pub(in crate::jobs) fn for_any(jobs: &Jobs, id: &JobId) -> Self {
        Self { file: jobs.0.handovers.want(id), changes: None, _begun: None }
    }

    /// For a job that is about to be put there. With its files at hand, the work on it may begin.
    pub(in crate::jobs) async fn for_new(jobs: &Jobs, record: &JobRecord, files: Option<InputBytes>) -> Self {
        let changes = Some(jobs.0.changes.subscribe());
        Self { file: jobs.0.handovers.want(&record.id), changes, _begun: jobs.begin(record, files).await }
    }
}

impl Jobs {
    /// Has the work on a job begin that was admitted and is not in the store yet; `None` where it is to wait for its turn.
    async fn begin(&self, record: &JobRecord, files: Option<InputBytes>) -> Option<Begun> {
        let (inner, files) = (&self.0, files?);
        let is_alone = !inner.store.records().are_shared() && inner.engine.is_isolated();
        let has_worker = || inner.running.at_work() + inner.head_starts.len() < inner.settings.workers.0;
        if !is_alone || inner.running.is_alone() || !has_worker() || self.cached(record).await.is_some() {
            return None;
        }
        let knowledge = library::knowledge(&inner.store, &record.principal, &record.request.rigs).await.ok()?;
        let memory = inner.memory.clone().try_take(record.memory_bytes).filter(|_| has_worker())?;
        let control = new_control();
        let work = self.work(record.request.clone(), files, knowledge, Arc::clone(&control));
        Some(inner.head_starts.add(&record.id, HeadStart { control, memory, work }))
    }

    /// As [`Jobs::wait`], but where the job succeeds in this process its first file comes as soon as it is complete.
    ///
    /// # Errors
    /// When there is none of that id.
    pub async fn wait_for_file(
        &self,
        owner: &Principal,
        id: &JobId,
        awaiting: Awaiting,
        longest: Duration,
    ) -> Result<Awaited, Refusal> {
        let Awaiting { file, changes, _begun } = awaiting;
        let ended = async {
            let job = match changes {
                Some(changes) => self.wait_with(changes, owner, id, longest).await?,
                None => self.wait(owner, id, longest).await?,
            };
            Ok(Awaited::Job(Box::new(job)))
        };
        let Some(mut wanting) = file else { return ended.await };
        tokio::select! {
            biased;
            Ok(file) = &mut wanting.file => Ok(Awaited::File(Box::new(file))),
            ended = ended => ended,
        }
    }

    /// Gives the first file of a job that has succeeded to who waits for it. To be dropped when `end` is written.
    pub(in crate::jobs) fn hand_over(
        &self,
        record: &JobRecord,
        end: &FinishedJob,
        timings: Timings,
        bytes: Option<Bytes>,
    ) -> Option<Given> {
        let (result, bytes) = end.results.first().cloned().zip(bytes)?;
        let record = JobRecord {
            state: JobState::Succeeded,
            warnings: end.warnings,
            judgment: end.judgment.clone(),
            cache_key: end.cache_key.clone(),
            ..record.clone()
        };
        self.0.handovers.give(HandedFile { record, result, bytes, timings })
    }
}
