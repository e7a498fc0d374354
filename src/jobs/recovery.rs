//! What becomes of the jobs that the last process did not finish.

use super::{FailureReason, JobEvent, Jobs, Refusal, next_state};
use crate::store::{JobRecord, JobState};

impl Jobs {
    /// Takes up every job that has not ended, oldest first. To be called once, before workers start.
    ///
    /// A job under which the process died `max_attempts` times is not tried again: it may be what kills it.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn recover(&self) -> Result<usize, Refusal> {
        let unfinished = self.0.store.records().unfinished_jobs().await?;
        let count = unfinished.len();
        for record in unfinished {
            self.recover_one(record).await?;
        }
        Ok(count)
    }

    async fn recover_one(&self, record: JobRecord) -> Result<(), Refusal> {
        let crashed_too_often =
            record.state == JobState::Running && u64::from(record.attempt) >= self.0.settings.max_attempts;
        if crashed_too_often {
            let failure = FailureReason::WorkerCrashed.because(
                format!("the service went down {} times while it worked on this job", record.attempt),
                "report it with the id of the job",
            );
            self.finish(&record.id, record.state, self.ending(JobState::Failed, Some(failure))).await?;
            return Ok(());
        }
        match next_state(record.state, JobEvent::Requeue) {
            Some(JobState::Canceled) => {
                self.finish(&record.id, record.state, self.ending(JobState::Canceled, None)).await?;
            }
            Some(next) => {
                self.0.store.records().move_job(&record.id, (record.state, next), record.attempt, None).await?;
                self.0.queue.push_acknowledged(record.id, record.input_bytes);
            }
            // It was waiting already.
            None => self.0.queue.push_acknowledged(record.id, record.input_bytes),
        }
        Ok(())
    }
}
