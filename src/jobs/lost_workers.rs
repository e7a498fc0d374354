//! What becomes of jobs whose worker is gone.

use std::time::Instant;

use super::{FailureReason, JobEvent, Jobs, Refusal, database_clock::Jump, next_state};
use crate::store::{AfterCrash, FinishedJob, JobFailure, JobRecord, JobState};

/// Looked at in one go; more are left for the next.
const MAX_AT_ONCE: usize = 100;

impl Jobs {
    /// Takes up the jobs that the last process left unfinished, where no other process can have them. To be called once, before
    /// workers start. Gives how many wait then.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn recover(&self) -> Result<u64, Refusal> {
        if !self.0.store.records().are_shared() {
            while self.take_from_lost_workers(true).await? == MAX_AT_ONCE {}
        }
        Ok(self.0.admission.refresh(self.0.store.records()).await?.jobs)
    }

    /// Puts jobs back into the queue whose worker has not been heard of for the length of a lease. Gives how many there were.
    pub(super) async fn take_from_lost_workers(&self, whose_ever: bool) -> Result<usize, Refusal> {
        if !whose_ever && !self.leases_tell_who_is_gone().await? {
            return Ok(0);
        }
        let decide = |job: &JobRecord, was_alone: bool| match self.0.running.has(job) {
            true => AfterCrash::Leave,
            false => self.after_crash(job, was_alone),
        };
        let lost = self.0.store.records().take_from_lost_workers(MAX_AT_ONCE, whose_ever, decide).await?;
        for (job, was_alone) in &lost {
            let crashes = job.crashes + u32::from(*was_alone);
            tracing::warn!(job_id = %job.id, attempt = job.attempt, crashes, was_alone, "a job's worker is gone");
            match self.after_crash(job, *was_alone) {
                AfterCrash::Leave => {}
                AfterCrash::Requeue => self.0.changes.announce(&job.id, JobState::Queued),
                AfterCrash::End(end) | AfterCrash::Quarantine(end, _) => self.announce_end(&job.id, &end),
            }
        }
        Ok(lost.len())
    }

    /// Whether leases that have run out are those of workers that are gone. Where somebody has set the clock of the database forward, all
    /// have run out: those who live extend theirs before this process looks again. Where it was set back, no lease would run out for as
    /// long as that, so they are set back with it.
    async fn leases_tell_who_is_gone(&self) -> Result<bool, Refusal> {
        let (records, period) = (self.0.store.records(), self.0.settings.lease_period.0);
        let now = records.database_time().await?;
        match self.0.database_clock.look(Instant::now(), now) {
            Some(Jump::Forward(jump)) if jump > period / 4 => {
                tracing::warn!(seconds = jump.as_secs_f64(), "the clock of the database was set forward");
                Ok(false)
            }
            Some(Jump::Back(jump)) if jump > period * 2 => {
                tracing::warn!(seconds = jump.as_secs_f64(), "the clock of the database was set back");
                records.set_leases_back(jump).await?;
                Ok(true)
            }
            _ => Ok(true),
        }
    }

    /// A job under which processes died `max_attempts` times is not tried again. A death is laid at the door of a job that was alone: which
    /// of several it was is found out by running each of them by itself.
    fn after_crash(&self, job: &JobRecord, was_alone: bool) -> AfterCrash {
        if next_state(job.state, JobEvent::Requeue) == Some(JobState::Canceled) {
            return AfterCrash::End(Box::new(self.ending(JobState::Canceled, None)));
        }
        let crashes = u64::from(job.crashes) + u64::from(was_alone);
        if !was_alone || crashes < self.0.settings.max_attempts {
            return AfterCrash::Requeue;
        }
        let until = self.0.clock.after(self.0.settings.quarantine_period.0);
        AfterCrash::Quarantine(Box::new(self.crashed_too_often(crashes)), until)
    }

    fn crashed_too_often(&self, crashes: u64) -> FinishedJob {
        let failure: JobFailure = FailureReason::WorkerCrashed.because(
            format!("the service went down {crashes} times while it worked on this job"),
            "report it with the id of the job",
        );
        self.ending(JobState::Failed, Some(failure))
    }
}
