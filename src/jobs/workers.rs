//! The tasks that run jobs beside the requests, and how they end.
//!
//! One task claims jobs, one at a time, for as many workers as there are; each job then runs by itself. Another task tells the store
//! that the jobs are still worked on, hears there which ones shall stop, and takes up those whose worker is gone. A third hears
//! what other processes do, so that nobody waits for longer than a message takes.

use std::{sync::Arc, time::Duration};

use futures::FutureExt as _;
use tokio::{
    task::JoinHandle,
    time::{Instant, sleep},
};
use tokio_util::{sync::CancellationToken, task::TaskTracker};

use super::{
    Jobs, Refusal,
    one_shot::{BegunWork, HeadStart, Seat, Seats},
    running::{RunningGuard, RunningJob, StopReason, new_control},
    service::Inner,
};
use crate::{
    config::Failpoint,
    store::{Claim, GiveBack, JobRecord, JobState, Lane, LeaseId, Notice, StoreError, Wanted},
    telemetry::Metric,
};

/// How often to look whether the other jobs of this process have ended.
const LOOK_WHETHER_ALONE: Duration = Duration::from_millis(20);
/// How long nobody looks into an empty queue. New jobs come with a notice, which can be lost where processes share the queue.
const LOOK_INTO_EMPTY_QUEUE: Duration = Duration::from_secs(2);
/// How long to leave the queue to others who are about to take from it.
const LEAVE_TO_OTHERS: Duration = Duration::from_millis(5);
/// How long to leave a store alone that has failed.
const AFTER_FAILURE: Duration = Duration::from_millis(500);

/// The workers of this process: each runs one job at a time.
#[derive(Debug)]
pub struct Workers {
    jobs: Jobs,
    running: TaskTracker,
    /// Nothing new from now on.
    stop: CancellationToken,
    claims: JoinHandle<()>,
    /// To be ended after the last job.
    others: [JoinHandle<()>; 2],
}

impl Workers {
    /// Starts `count` of them. With 0, what others run is still followed.
    #[must_use]
    pub fn start(jobs: &Jobs, count: usize) -> Self {
        let (running, stop) = (TaskTracker::new(), CancellationToken::new());
        let claiming = Claiming { jobs: jobs.clone(), running: running.clone(), stop: stop.clone() };
        let others = [tokio::spawn(keep_leases(jobs.clone())), tokio::spawn(hear_others(jobs.clone()))];
        Metric::WorkerSlots.set([], count as f64);
        Self { jobs: jobs.clone(), running, stop, claims: tokio::spawn(claiming.run(count)), others }
    }

    /// Starts nothing new, gives running jobs `grace` to end, and hands the rest back to the queue.
    pub async fn stop(self, grace: Duration) {
        self.stop.cancel();
        if let Err(error) = self.claims.await {
            tracing::error!(%error, "the task that claims jobs ended with a fault");
        }
        self.running.close();
        if tokio::time::timeout(grace, self.running.wait()).await.is_err() {
            self.jobs.0.running.stop_all(StopReason::Draining);
            /// A job looks every few milliseconds; the lease of one that does not runs out.
            const LAST_CHANCE: Duration = Duration::from_secs(5);
            let _ = tokio::time::timeout(LAST_CHANCE, self.running.wait()).await;
        }
        for task in self.others {
            task.abort();
        }
    }
}

/// A job that this process has, and what it takes up while it runs.
struct Taken {
    record: JobRecord,
    running: Arc<RunningJob>,
    begun: Option<BegunWork>,
    seat: Seat,
    is_suspect: bool,
    _entry: RunningGuard,
}

/// How to look into the queue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Look {
    /// See whether there is something: nothing is expected.
    Glance,
    /// Take what is there.
    Claim,
    /// The same, but the lease may have a job without anybody knowing.
    AfterFailure,
}

struct Claiming {
    jobs: Jobs,
    running: TaskTracker,
    stop: CancellationToken,
}

impl Claiming {
    async fn run(self, count: usize) {
        let seats = Seats::new(count);
        while let Some(taken) = self.next(&seats).await {
            if taken.is_suspect {
                self.run_alone(taken).await;
            } else {
                self.start(taken);
            }
        }
    }

    fn start(&self, mut taken: Taken) -> JoinHandle<()> {
        let jobs = self.jobs.clone();
        self.running.spawn(async move {
            let begun = taken.begun.take();
            jobs.run_one(&taken.record, &taken.running, begun, &mut taken.seat).await;
            drop(taken);
        })
    }

    /// Runs a job that may be what brings processes down, while this process runs nothing else: if it goes down now, it is known why.
    async fn run_alone(&self, taken: Taken) {
        let inner = &self.jobs.0;
        let _alone = inner.running.let_nobody_begin();
        let others = async {
            while inner.running.len() > 1 || inner.head_starts.len() > 0 {
                sleep(LOOK_WHETHER_ALONE).await;
            }
        };
        if self.unless_stopped(others).await.is_none() {
            return self.jobs.give_back(&taken.record, &taken.running, GiveBack::Drained).await;
        }
        match inner.store.records().mark_alone(&taken.record.id, &taken.running.lease).await {
            Ok(true) => {
                // It tells of its own faults.
                let _ = self.start(taken).await;
            }
            // In other hands, or told to stop: its worker finds out which.
            Ok(false) => drop(self.start(taken)),
            Err(error) => {
                tracing::error!(job_id = %taken.record.id, %error, "a job that is to run alone is given back");
                self.jobs.give_back(&taken.record, &taken.running, GiveBack::Drained).await;
            }
        }
    }

    /// The next job, when a worker is free and there is memory for it; `None` when it is time to stop.
    async fn next(&self, seats: &Seats) -> Option<Taken> {
        let lease = LeaseId::new();
        let (record, mut seat, is_suspect) = self.claim(&lease, seats).await?;
        Failpoint::JobClaimed.reach();
        let inner = &self.jobs.0;
        let (control, memory, begun) = match inner.head_starts.take_over(&record.id) {
            Some(HeadStart { control, memory, work }) => (control, Some(memory), Some(work)),
            None => (new_control(), None, None),
        };
        // Entered before anything is waited for, so that its lease is extended and a cancel finds what to stop.
        let (running, entry) = inner.running.enter(&record.id, lease, control);
        inner.changes.announce(&record.id, JobState::Running);
        let memory = match memory {
            Some(memory) => memory,
            None => match self.unless_stopped(inner.memory.clone().take(record.memory_bytes)).await {
                Some(memory) => memory?,
                None => {
                    self.jobs.give_back(&record, &running, GiveBack::Drained).await;
                    return None;
                }
            },
        };
        seats.give(&mut seat, record.batch.is_some(), memory);
        Some(Taken { record, running, begun, seat, is_suspect, _entry: entry })
    }

    async fn unless_stopped<T>(&self, future: impl Future<Output = T>) -> Option<T> {
        tokio::select! {
            biased;
            () = self.stop.cancelled() => None,
            done = future => Some(done),
        }
    }

    async fn claim(&self, lease: &LeaseId, seats: &Seats) -> Option<(JobRecord, Seat, bool)> {
        // Where a seat is still free, nothing waited a moment ago.
        let (free, mut look) = match seats.free().now_or_never() {
            Some(free) => (free, Look::Glance),
            None => (self.unless_stopped(seats.free()).await?, Look::Claim),
        };
        let mut seat = free?;
        loop {
            if self.stop.is_cancelled() {
                return None;
            }
            // An arrival from here on is remembered, so none is missed between looking and waiting.
            let arrival = self.jobs.0.changes.arrival();
            let wait = match self.look(look, lease, seat.wanted).await {
                Ok(Claim::Job(record)) => return Some((*record, seat, false)),
                Ok(Claim::Suspect(record)) => return Some((*record, seat, true)),
                Ok(Claim::Contended) if look == Look::Glance => {
                    look = Look::Claim;
                    continue;
                }
                Ok(Claim::Contended) => LEAVE_TO_OTHERS,
                Ok(Claim::NothingFor(wait)) => wait.min(LOOK_INTO_EMPTY_QUEUE),
                Ok(Claim::Nothing) => LOOK_INTO_EMPTY_QUEUE,
                Err(error) => {
                    tracing::error!(%error, "no job could be claimed");
                    look = Look::AfterFailure;
                    self.unless_stopped(sleep(AFTER_FAILURE)).await?;
                    continue;
                }
            };
            let came = self.unless_stopped(async {
                tokio::select! {
                    arrived = tokio::time::timeout(wait, arrival) => (arrived.is_ok(), None),
                    worker = seats.worker(), if seat.wanted.last == Lane::Single => (true, worker),
                }
            });
            let (is_expected, worker) = came.await?;
            look = if is_expected { Look::Claim } else { Look::Glance };
            seat = worker.unwrap_or(seat);
        }
    }

    async fn look(&self, look: Look, lease: &LeaseId, wanted: Wanted) -> Result<Claim, StoreError> {
        let Inner { store, settings, clock, .. } = &*self.jobs.0;
        let records = store.records();
        match look {
            Look::Glance => return records.look_into_queue(wanted.last).await,
            Look::Claim => {}
            Look::AfterFailure => {
                if let Some(record) = records.leased(lease).await? {
                    return Ok(Claim::Job(Box::new(record)));
                }
            }
        }
        records.claim_job(lease, settings.lease_period.0, clock.now(), wanted).await
    }
}

/// Extends the leases of the jobs of this process, and takes up those whose worker is gone.
async fn keep_leases(jobs: Jobs) {
    let period = jobs.0.settings.lease_period.0;
    let mut last_reached = Instant::now();
    loop {
        sleep(period / 3).await;
        let extended = jobs.extend_leases().await;
        // Where the store could not be reached for a while, others could not extend theirs either: they come first.
        let done = match extended {
            Ok(()) if last_reached.elapsed() < period => jobs.take_from_lost_workers(false).await.map(|_| ()),
            other => other,
        };
        match done {
            Ok(()) => last_reached = Instant::now(),
            Err(error) => tracing::error!(%error, "the leases of jobs could not be looked after"),
        }
    }
}

async fn hear_others(jobs: Jobs) {
    loop {
        if let Err(error) = jobs.hear_others().await {
            tracing::error!(%error, "other processes cannot be heard");
        } else {
            return;
        }
        sleep(AFTER_FAILURE).await;
    }
}

impl Jobs {
    async fn extend_leases(&self) -> Result<(), Refusal> {
        let held = self.0.running.held();
        if held.is_empty() {
            return Ok(());
        }
        let states = self.0.store.records().extend_leases(&held, self.0.settings.lease_period.0).await?;
        for (held, state) in held.iter().zip(states) {
            match state {
                Some(JobState::Canceling) => self.0.running.stop(&held.id, StopReason::Canceled),
                Some(_) => {}
                None => self.0.running.lose(held),
            }
        }
        Ok(())
    }

    /// Hears what other processes do, for ever; returns at once when there are none.
    async fn hear_others(&self) -> Result<(), Refusal> {
        let Some(mut listener) = self.0.store.records().listen().await? else { return Ok(()) };
        loop {
            match listener.next().await? {
                Notice::Job(id, state) => {
                    if state == JobState::Canceling {
                        self.0.running.stop(&id, StopReason::Canceled);
                    }
                    self.0.changes.announce(&id, state);
                }
                Notice::Missed => self.0.changes.announce_anything(),
            }
        }
    }
}
