//! Running one job, from its claim to its end.

use std::{
    sync::Arc,
    time::{Duration, Instant},
};

use bytes::Bytes;
use futures::future::try_join_all;

use super::{
    EngineRequest, EngineResult, FailureReason, JobEvent, Jobs, OutputFile, Question, Refusal,
    engine::InputBytes,
    failure, library, next_state,
    one_shot::{BegunWork, Seat},
    result_names,
    running::{RunningJob, StopReason},
    thread::{in_place, on_own_thread},
};
use crate::{
    config::{Failpoint, Isolation},
    engine::{Control, FailureCode, Format, Knowledge, Output, Timings},
    store::{
        CachedResults, FinishedJob, GiveBack, JobFailure, JobRecord, JobRequest, JobState, ResultId, ResultRecord,
        UnnamedBlob,
    },
    telemetry::{Metric, Part, Span, TraceContext},
};

/// How an attempt ended.
enum Attempt {
    /// Another job has computed the same.
    Known(Box<CachedResults>),
    Done(Box<EngineResult>),
    Failed(JobFailure),
    Stopped,
    Requeued,
    /// Files or records could not be reached.
    Unreachable(Refusal),
    /// The job is somebody else's by now.
    Lost,
}

/// How long a job that was told to stop may take to do so before it is given up.
const STOP_MARGIN: Duration = Duration::from_secs(5);
/// How long to leave a store alone that has not taken the end of a job.
const AFTER_FAILURE: Duration = Duration::from_millis(200);

impl Jobs {
    /// Runs a job that was claimed, to its end; the work on it may have begun. Where its end cannot be written its lease runs out, and another worker does it again.
    pub(super) async fn run_one(
        &self,
        record: &JobRecord,
        running: &Arc<RunningJob>,
        begun: Option<BegunWork>,
        seat: &mut Seat,
    ) {
        self.observe_start(record);
        let began = begun.as_ref().map_or_else(Instant::now, |work| work.at);
        let mut span = span_of(record, began);
        let attempt = match begun {
            Some(work) => self.attempt(record, running, work, &span).await,
            None => self.begin_here(record, running, &span).await,
        };
        tracing::debug!(job_id = %record.id, seconds = began.elapsed().as_secs_f64(), "an attempt is over");
        if let Attempt::Failed(failure) = &attempt {
            span.fail(&failure.code);
        }
        let ended = match attempt {
            Attempt::Known(found) => match self.succeed_again(record, running, &found).await {
                // Gone in the meantime: another worker, or this one, will not find it again.
                Ok(false) => {
                    self.give_back(record, running, GiveBack::Drained).await;
                    Ok(())
                }
                done => done.map(|_| ()),
            },
            Attempt::Done(ran) => {
                // Only here: a job that fails may stop the next one of its batch.
                running.mark_computed();
                seat.leave();
                let began = Instant::now();
                let done = self.succeed(record, running, *ran).await;
                span.add_part("keep results", began, began.elapsed());
                done
            }
            Attempt::Failed(failure) => self.end(record, running, JobEvent::Fail, Some(failure)).await,
            Attempt::Stopped => self.end(record, running, JobEvent::Stop, None).await,
            Attempt::Requeued => {
                self.give_back(record, running, GiveBack::Drained).await;
                Ok(())
            }
            Attempt::Unreachable(refusal) => Err(refusal),
            Attempt::Lost => {
                tracing::warn!(job_id = %record.id, "the job went to another worker, since this one was not heard of");
                Ok(())
            }
        };
        if let Err(refusal) = ended {
            self.retry_or_fail(record, running, &refusal).await;
        }
    }

    fn observe_start(&self, record: &JobRecord) {
        let started = record.started_at.unwrap_or(record.created_at).as_millisecond();
        let waited = started.saturating_sub(record.created_at.as_millisecond());
        Metric::JobQueueWait.observe([], Duration::from_millis(u64::try_from(waited).unwrap_or(0)));
        Metric::JobAttempts.count([], 1);
    }

    async fn begin_here(&self, record: &JobRecord, running: &Arc<RunningJob>, span: &Span) -> Attempt {
        if let Some(found) = self.cached(record).await {
            return Attempt::Known(Box::new(found));
        }
        let began = Instant::now();
        let (files, knowledge) = match self.prepare(record).await {
            Ok(prepared) => prepared,
            Err(refusal) => return Attempt::Unreachable(refusal),
        };
        span.add_part("fetch inputs", began, began.elapsed());
        let work = self.work(record.request.clone(), files, knowledge, Arc::clone(&running.control));
        self.attempt(record, running, work, span).await
    }

    async fn attempt(
        &self,
        record: &JobRecord,
        running: &Arc<RunningJob>,
        BegunWork { at: began, mut outcome }: BegunWork,
        span: &Span,
    ) -> Attempt {
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
        let engine = span.add_part("engine", began, began.elapsed());
        match received.ok().flatten() {
            Some(Ok(ran)) => {
                engine.add_parts(phases(&ran.timings));
                Attempt::Done(Box::new(ran))
            }
            Some(Err(failure)) if failure.code == FailureCode::Canceled => self.stopped(running),
            Some(Err(failure)) => Attempt::Failed(failure::keep(failure)),
            None => {
                tracing::error!(job_id = %record.id, "a job panicked");
                Attempt::Failed(failure::internal())
            }
        }
    }

    /// Reads what the engine needs.
    async fn prepare(&self, record: &JobRecord) -> Result<(InputBytes, Knowledge), Refusal> {
        let files = InputBytes::read(&self.0.store, &record.request).await?;
        Ok((files, library::knowledge(&self.0.store, &record.principal, &record.request.rigs).await?))
    }

    /// Has the engine work on files, on a thread of its own unless the settings want otherwise.
    pub(super) fn work(
        &self,
        request: JobRequest,
        files: InputBytes,
        knowledge: Knowledge,
        control: Arc<Control>,
    ) -> BegunWork {
        let inner = Arc::clone(&self.0);
        let at = Instant::now();
        let is_inline = inner.settings.isolation == Isolation::Inline;
        let work = move || {
            Failpoint::EngineRuns.reach();
            let formats: Vec<Format> = request.formats.iter().filter_map(|name| Format::from_name(name)).collect();
            let (formats, knowledge, limits) = (formats.as_slice(), &knowledge, &inner.limits);
            let question = Question::of_job(&request.task)?;
            let asked = EngineRequest { question, files: files.files(&request), formats, knowledge, limits };
            inner.engine.ask(&asked, &control)?.ran()
        };
        let outcome = if is_inline { in_place(work) } else { on_own_thread("retarget", work) };
        BegunWork { at, outcome }
    }

    fn stopped(&self, running: &RunningJob) -> Attempt {
        match running.stop_reason() {
            Some(StopReason::Canceled) => Attempt::Stopped,
            Some(StopReason::Draining) => Attempt::Requeued,
            Some(StopReason::TimedOut) => Attempt::Failed(self.timed_out()),
            Some(StopReason::LeaseLost) => Attempt::Lost,
            None => {
                tracing::error!("the engine stopped without being asked to");
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
    async fn succeed(&self, record: &JobRecord, running: &RunningJob, ran: EngineResult) -> Result<(), Refusal> {
        let EngineResult { outputs, report, resolved_spec, timings, warnings, judgment } = ran;
        observe(&timings);
        let (created_at, expires_at) = (self.0.clock.now(), self.0.clock.after(self.0.settings.result_retention.0));
        let (mut results, mut blobs, mut first, mut names) = (Vec::new(), Vec::new(), None, Vec::new());
        for OutputFile { output: Output { format, name, bytes }, sha256 } in outputs {
            let bytes = Bytes::from(bytes);
            let blob = match self.0.store.blobs().write(bytes.clone(), sha256).await.map_err(Refusal::from) {
                Ok(blob) => blob,
                Err(Refusal::StorageFull(_)) => return self.fail_for_room(record, running).await,
                Err(refusal) => return Err(refusal),
            };
            results.push(ResultRecord {
                id: ResultId::new(),
                job_id: record.id.clone(),
                format: format.info().name.to_owned(),
                file_name: result_names::name_of(&record.request, &name, &mut names),
                sha256: blob.blob().sha256.clone(),
                bytes: blob.blob().bytes,
                created_at,
                expires_at,
            });
            first.get_or_insert(bytes);
            blobs.push(blob);
        }
        Failpoint::ResultsComplete.reach();
        let end = FinishedJob {
            report: Some(report),
            resolved_spec: Some(resolved_spec),
            warnings,
            judgment,
            results,
            cache_key: self.cache_key(&record.request),
            ..self.ending(JobState::Succeeded, None)
        };
        let _given = self.hand_over(record, &end, timings, first);
        let digests: Vec<&str> = end.results.iter().map(|result| result.sha256.as_str()).collect();
        let _held = self.0.store.hold_blobs(&digests).await?;
        match try_join_all(blobs.into_iter().map(UnnamedBlob::keep)).await.map_err(Refusal::from) {
            Ok(_) => {}
            Err(Refusal::StorageFull(_)) => return self.fail_for_room(record, running).await,
            Err(refusal) => return Err(refusal),
        }
        Failpoint::ResultsKept.reach();
        self.write_end(record, running, JobEvent::Succeed, end).await
    }

    async fn fail_for_room(&self, record: &JobRecord, running: &RunningJob) -> Result<(), Refusal> {
        let failure = FailureReason::StorageFull
            .because("the disk has no room for the results", "try again later, or ask the operator for more room");
        self.end(record, running, JobEvent::Fail, Some(failure)).await
    }

    async fn end(
        &self,
        record: &JobRecord,
        running: &RunningJob,
        event: JobEvent,
        failure: Option<JobFailure>,
    ) -> Result<(), Refusal> {
        let end = self.ending(JobState::Failed, failure);
        self.write_end(record, running, event, end).await
    }

    /// Writes the end, whatever unfinished state the job is in by now. A store that does not answer is asked again until the lease
    /// could have run out; what it may have written without saying so is recognized.
    pub(super) async fn write_end(
        &self,
        record: &JobRecord,
        running: &RunningJob,
        event: JobEvent,
        end: FinishedJob,
    ) -> Result<(), Refusal> {
        let deadline = tokio::time::Instant::now() + self.0.settings.lease_period.0;
        loop {
            match self.try_to_end(record, running, event, &end).await {
                Err(error) if tokio::time::Instant::now() < deadline => {
                    tracing::warn!(job_id = %record.id, %error, "the end of a job could not be written yet");
                    tokio::time::sleep(AFTER_FAILURE).await;
                }
                done => return done,
            }
        }
    }

    async fn try_to_end(
        &self,
        record: &JobRecord,
        running: &RunningJob,
        event: JobEvent,
        end: &FinishedJob,
    ) -> Result<(), Refusal> {
        for from in [JobState::Running, JobState::Canceling] {
            let Some(state) = next_state(from, event) else { continue };
            // Who asked for it to stop is not interested in how it would have failed.
            let failure = end.failure.clone().filter(|_| state == JobState::Failed);
            let end = FinishedJob { state, failure, ..end.clone() };
            if self.finish(&record.id, (from, Some(&running.lease)), end).await? {
                return Ok(());
            }
        }
        let now = self.0.store.records().job(&record.id).await?;
        if let Some(ended) = now.filter(|job| job.state.is_final() && job.lease.as_ref() == Some(&running.lease)) {
            self.0.changes.announce(&record.id, ended.state);
            return Ok(());
        }
        tracing::warn!(job_id = %record.id, ?event, "a job ended in other hands");
        Ok(())
    }

    /// Gives the job back. What was told to stop in the meantime ends.
    pub(super) async fn give_back(&self, record: &JobRecord, running: &RunningJob, why: GiveBack) {
        let given = match self.0.store.records().give_back(&record.id, &running.lease, why).await {
            Ok(true) => {
                tracing::info!(job_id = %record.id, ?why, "the job waits for another worker");
                self.0.changes.announce(&record.id, JobState::Queued);
                Ok(())
            }
            Ok(false) => self.end(record, running, JobEvent::Requeue, None).await,
            Err(error) => Err(error.into()),
        };
        if let Err(error) = given {
            tracing::error!(job_id = %record.id, %error, "the job could not be given back; its lease runs out");
        }
    }

    /// What becomes of a job when the store failed under it: it is tried again some times, later and later.
    async fn retry_or_fail(&self, record: &JobRecord, running: &RunningJob, refusal: &Refusal) {
        tracing::error!(job_id = %record.id, error = %refusal, retries = record.retries, "the store failed under a job");
        let is_passing = matches!(refusal, Refusal::Store(error) if error.is_passing());
        if is_passing && u64::from(record.retries) < self.0.settings.max_retries {
            let why = GiveBack::RetryAfter(retry_delay(record.retries, running.lease.as_str()));
            return self.give_back(record, running, why).await;
        }
        let failure = if is_passing {
            let detail = format!("files or records could not be reached in {} attempts", record.retries + 1);
            FailureReason::Unavailable.because(detail, "try again later")
        } else {
            failure::internal()
        };
        if let Err(error) = self.end(record, running, JobEvent::Fail, Some(failure)).await {
            tracing::error!(job_id = %record.id, %error, "the end of a job could not be written; its lease runs out");
        }
    }
}

/// One second, then four, then sixteen, and so on, each up to a half more, so that jobs that failed together do not come together.
fn retry_delay(retries: u32, lease: &str) -> Duration {
    let seconds = 4_u64.saturating_pow(retries.min(6));
    // The lease's last letters are random.
    let part = lease.bytes().rev().take(2).fold(0, |sum, letter| sum * 36 + u64::from(letter) % 36) % 512;
    Duration::from_millis(seconds * 1000 + seconds * part)
}

fn observe(timings: &Timings) {
    for (phase, duration) in phases(timings).into_iter().chain([("total", seconds(timings.total_seconds))]) {
        Metric::JobDuration.observe([("phase", phase.to_owned())], duration);
    }
}

/// What the engine did, one after the other.
fn phases(timings: &Timings) -> [(&'static str, Duration); 4] {
    [
        ("read", seconds(timings.read_seconds)),
        ("plan", seconds(timings.plan_seconds)),
        ("retarget", seconds(timings.retarget_seconds)),
        ("write", seconds(timings.write_seconds)),
    ]
}

fn seconds(seconds: f64) -> Duration {
    Duration::try_from_secs_f64(seconds).unwrap_or_default()
}

/// The span of an attempt that has begun, below the request that asked for the job, and beside it how long the job has waited.
fn span_of(record: &JobRecord, began: Instant) -> Span {
    let asked_by = record.trace_context.as_deref().and_then(TraceContext::parse);
    if let Some(started_at) = record.started_at {
        Part::between("wait in queue", asked_by.as_ref(), (record.created_at, started_at));
    }
    let mut span = Span::of_work("run job", asked_by.as_ref(), began);
    span.note("retargetd.job_id", || record.id.to_string());
    span.note("retargetd.job_kind", || record.kind().name());
    span.note("retargetd.attempt", || i64::from(record.attempt));
    span
}

/// Counts a thread that does not stop for as long as it goes on.
fn watch_stuck<T: Send + 'static>(outcome: tokio::sync::oneshot::Receiver<T>) {
    Metric::JobsStuck.change(1.0);
    tokio::spawn(async move {
        let _ = outcome.await;
        Metric::JobsStuck.change(-1.0);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn retries_come_later_and_later_and_not_together() {
        let delays: Vec<Duration> = (0..5).map(|retries| retry_delay(retries, "lse_a7")).collect();
        assert!(delays.windows(2).all(|pair| pair[1] > pair[0] * 2), "later and later: {delays:?}");
        assert!(retry_delay(0, "lse_a7") != retry_delay(0, "lse_b3"), "not together");
        assert!(retry_delay(u32::MAX, "lse_a7") < Duration::from_secs(8000), "but not for ever");
    }
}
