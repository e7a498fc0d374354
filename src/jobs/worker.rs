//! Running one job, from the queue to its end.

use std::{sync::Arc, time::Instant};

use super::{
    FailureReason, JobEvent, Jobs, Refusal,
    bridge::on_own_thread,
    failure, next_state,
    running::{RunningJob, StopReason},
};
use crate::{
    engine::{Failure, FailureCode, Format, Outcome, Output},
    store::{FinishedJob, JobFailure, JobId, JobRecord, JobState, ResultId, ResultRecord},
    telemetry::Metric,
};

/// How an attempt ended.
enum Attempt {
    Done(Box<Outcome>),
    Failed(JobFailure),
    Stopped,
    Requeued,
}

/// How long a job that was told to stop may take to do so before it is given up.
const STOP_MARGIN: std::time::Duration = std::time::Duration::from_secs(5);

impl Jobs {
    /// Runs a job that was taken from the queue, to its end.
    pub(super) async fn run_one(&self, id: JobId) {
        // The entry exists before the state says `running`, so that a cancel always finds what to stop.
        let (running, _guard) = self.0.running.enter(&id);
        let outcome = async {
            let Some(record) = self.0.store.records().job(&id).await? else { return Ok(()) };
            let Some(record) = self.start(record).await? else { return Ok(()) };
            self.run(record, running).await
        };
        if let Err(refusal) = outcome.await {
            tracing::error!(job_id = %id, error = %refusal, "the end of a job could not be written");
            self.give_up(&id).await;
        }
    }

    /// Ends a job whose end could not be written, so that nobody waits for it in vain. Where that fails too, the record still
    /// says that the job has not ended, and the next start takes it up again.
    async fn give_up(&self, id: &JobId) {
        for from in [JobState::Running, JobState::Canceling] {
            let end = self.ending(JobState::Failed, Some(failure::internal()));
            if let Err(error) = self.finish(id, from, end).await {
                tracing::error!(job_id = %id, %error, "neither could that it failed");
            }
        }
    }

    async fn start(&self, mut record: JobRecord) -> Result<Option<JobRecord>, Refusal> {
        let Some(next) = next_state(record.state, JobEvent::Start) else { return Ok(None) };
        let now = self.0.clock.now();
        let attempt = record.attempt + 1;
        if !self.0.store.records().move_job(&record.id, (record.state, next), attempt, Some(now)).await? {
            return Ok(None);
        }
        let waited = now.as_millisecond().saturating_sub(record.created_at.as_millisecond());
        Metric::JobQueueWait.observe([], std::time::Duration::from_millis(u64::try_from(waited).unwrap_or(0)));
        Metric::JobAttempts.count([], 1);
        (record.state, record.attempt, record.started_at) = (next, attempt, Some(now));
        self.announce(&record.id);
        Ok(Some(record))
    }

    async fn run(&self, record: JobRecord, running: Arc<RunningJob>) -> Result<(), Refusal> {
        let began = Instant::now();
        let attempt = self.attempt(&record, &running).await;
        tracing::debug!(job_id = %record.id, seconds = began.elapsed().as_secs_f64(), "an attempt is over");
        match attempt {
            Attempt::Done(outcome) => self.succeed(&record, *outcome).await,
            Attempt::Failed(failure) => self.end(&record, JobEvent::Fail, Some(failure)).await,
            Attempt::Stopped => self.end(&record, JobEvent::Stop, None).await,
            Attempt::Requeued => self.requeue(&record).await,
        }
    }

    async fn attempt(&self, record: &JobRecord, running: &Arc<RunningJob>) -> Attempt {
        let work = match self.prepare(record, running).await {
            Ok(work) => work,
            Err(error) => {
                tracing::error!(job_id = %record.id, %error, "the inputs of a job could not be read");
                return Attempt::Failed(failure::internal());
            }
        };
        let mut outcome = on_own_thread("retarget", work);
        let limit = self.0.settings.job_timeout.0;
        let received = match tokio::time::timeout(limit, &mut outcome).await {
            Ok(received) => received,
            Err(_) => {
                running.stop(StopReason::TimedOut);
                match tokio::time::timeout(STOP_MARGIN, &mut outcome).await {
                    Ok(received) => received,
                    Err(_) => {
                        tracing::error!(job_id = %record.id, "a job ignores its deadline and is given up");
                        watch_stuck(outcome);
                        return Attempt::Failed(self.timed_out());
                    }
                }
            }
        };
        match received.ok().flatten() {
            Some(Ok(outcome)) => Attempt::Done(Box::new(outcome)),
            Some(Err(failure)) if failure.code == FailureCode::Canceled => self.stopped(running),
            Some(Err(failure)) => Attempt::Failed(failure::keep(failure)),
            None => {
                tracing::error!(job_id = %record.id, "a job panicked");
                Attempt::Failed(failure::internal())
            }
        }
    }

    /// Reads the inputs and packs them with the engine into something that a thread can run.
    async fn prepare(
        &self,
        record: &JobRecord,
        running: &Arc<RunningJob>,
    ) -> Result<impl FnOnce() -> Result<Outcome, Failure> + Send + 'static, Refusal> {
        let request = record.request.clone();
        let files = self.read_inputs(&request).await?;
        let knowledge = self.knowledge(&request).await?;
        let inner = Arc::clone(&self.0);
        let running = Arc::clone(running);
        Ok(move || {
            let formats: Vec<Format> = request.formats.iter().filter_map(|name| Format::from_name(name)).collect();
            inner.engine.retarget(&files.inputs(&request, &formats), &knowledge, &inner.limits, &running.control)
        })
    }

    fn stopped(&self, running: &RunningJob) -> Attempt {
        match running.stop_reason() {
            Some(StopReason::Canceled) => Attempt::Stopped,
            Some(StopReason::Draining) => Attempt::Requeued,
            Some(StopReason::TimedOut) => Attempt::Failed(self.timed_out()),
            None => {
                tracing::error!("the engine stopped although nobody had asked it to");
                Attempt::Failed(failure::internal())
            }
        }
    }

    fn timed_out(&self) -> JobFailure {
        let seconds = self.0.settings.job_timeout.0.as_secs_f64();
        FailureReason::JobTimeout.because(
            format!("the job took longer than the limit 'job_timeout' of {seconds} seconds allows"),
            "send less at once (fewer frames, a lower rate), or ask the operator to raise the limit",
        )
    }

    /// Results first, record last: what the record names is there.
    async fn succeed(&self, record: &JobRecord, outcome: Outcome) -> Result<(), Refusal> {
        observe(&outcome);
        let Outcome { outputs, report, resolved_spec } = outcome;
        let mut files = Vec::with_capacity(outputs.len());
        for Output { format, name, bytes } in outputs {
            match self.0.store.blobs().write(bytes.into()).await.map_err(Refusal::from) {
                Ok(blob) => files.push((format, name, blob)),
                Err(Refusal::StorageFull) => return self.fail_for_room(record).await,
                Err(refusal) => return Err(refusal),
            }
        }
        let _held = self.0.store.hold_blobs().await;
        let (created_at, expires_at) = (self.0.clock.now(), self.0.clock.after(self.0.settings.result_retention.0));
        let mut results = Vec::with_capacity(files.len());
        for (format, file_name, blob) in files {
            let blob = blob.keep().await?;
            results.push(ResultRecord {
                id: ResultId::new(),
                job_id: record.id.clone(),
                format: format.info().name.to_owned(),
                file_name,
                sha256: blob.sha256,
                bytes: blob.bytes,
                created_at,
                expires_at,
            });
        }
        let end = FinishedJob {
            report: serde_json::to_string(&report).ok(),
            resolved_spec: Some(resolved_spec.to_string()),
            warnings: report.warnings.len() as u64,
            results,
            ..self.ending(JobState::Succeeded, None)
        };
        self.write_end(record, JobEvent::Succeed, end).await
    }

    async fn fail_for_room(&self, record: &JobRecord) -> Result<(), Refusal> {
        let failure = FailureReason::StorageFull
            .because("there is no room for the results", "try again later, or ask the operator for more room");
        self.end(record, JobEvent::Fail, Some(failure)).await
    }

    async fn end(&self, record: &JobRecord, event: JobEvent, failure: Option<JobFailure>) -> Result<(), Refusal> {
        let end = self.ending(JobState::Failed, failure);
        self.write_end(record, event, end).await
    }

    /// Writes the end, whatever unfinished state the job is in by now.
    async fn write_end(&self, record: &JobRecord, event: JobEvent, end: FinishedJob) -> Result<(), Refusal> {
        for from in [JobState::Running, JobState::Canceling] {
            let Some(state) = next_state(from, event) else { continue };
            // Who asked for it to stop is not interested in how it would have failed.
            let failure = end.failure.clone().filter(|_| state == JobState::Failed);
            if self.finish(&record.id, from, FinishedJob { state, failure, ..end.clone() }).await? {
                return Ok(());
            }
        }
        tracing::error!(job_id = %record.id, ?event, "a job ended in a state in which it cannot");
        self.give_up(&record.id).await;
        Ok(())
    }

    /// Gives the job back, with its attempt not counted.
    async fn requeue(&self, record: &JobRecord) -> Result<(), Refusal> {
        let change = (JobState::Running, JobState::Queued);
        if self.0.store.records().move_job(&record.id, change, record.attempt - 1, None).await? {
            tracing::info!(job_id = %record.id, "the job waits for the next start");
            self.announce(&record.id);
            return Ok(());
        }
        self.end(record, JobEvent::Requeue, None).await
    }
}

fn observe(outcome: &Outcome) {
    let timings = outcome.report.timings;
    let phases = [
        ("read", timings.read_seconds),
        ("plan", timings.plan_seconds),
        ("retarget", timings.retarget_seconds),
        ("write", timings.write_seconds),
        ("total", timings.total_seconds),
    ];
    for (phase, seconds) in phases {
        let duration = std::time::Duration::try_from_secs_f64(seconds).unwrap_or_default();
        Metric::JobDuration.observe([("phase", phase.to_owned())], duration);
    }
}

/// Counts a thread that does not stop for as long as it goes on.
fn watch_stuck<T: Send + 'static>(outcome: tokio::sync::oneshot::Receiver<T>) {
    Metric::JobsStuck.change(1.0);
    tokio::spawn(async move {
        let _ = outcome.await;
        Metric::JobsStuck.change(-1.0);
    });
}
