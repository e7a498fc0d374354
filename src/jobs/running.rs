//! The jobs that workers of this process have, and how to stop them.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use crate::{
    engine::Control,
    store::{Held, JobId, JobRecord, LeaseId, StoredProgress},
    telemetry::{Metric, monotonic_seconds},
};

/// Why a running job was told to stop. The first reason stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StopReason {
    /// Somebody asked for it.
    Canceled,
    /// It ran too long.
    TimedOut,
    /// The service is going down.
    Draining,
    /// The job went to somebody else, because this process was not heard of for too long.
    LeaseLost,
}

/// A control for work that has not begun.
pub(super) fn new_control() -> Arc<Control> {
    Arc::new(Control::with_clock(monotonic_seconds))
}

/// How far the work under a control is, as it is kept.
pub(super) fn progress_of(control: &Control) -> StoredProgress {
    let progress = control.progress();
    StoredProgress { phase: progress.phase.name().to_owned(), done: progress.done, total: progress.total }
}

/// A job that a worker has.
#[derive(Debug)]
pub(super) struct RunningJob {
    /// The hold on it.
    pub(super) lease: LeaseId,
    /// Shared with the engine.
    pub(super) control: Arc<Control>,
    reason: Mutex<Option<StopReason>>,
    is_computed: AtomicBool,
}

impl RunningJob {
    /// Tells it to stop.
    pub(super) fn stop(&self, reason: StopReason) {
        self.reason.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
        self.control.cancel();
    }

    /// Says that the engine is done with it, and that only its end is left to write.
    pub(super) fn mark_computed(&self) {
        self.is_computed.store(true, Ordering::Relaxed);
    }

    /// Why it was told to stop.
    pub(super) fn stop_reason(&self) -> Option<StopReason> {
        *self.reason.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// All of them, by id.
#[derive(Debug, Default)]
pub(super) struct RunningJobs {
    jobs: Mutex<BTreeMap<JobId, Arc<RunningJob>>>,
    /// Whether one of them runs by itself, so that no work may begin beside it.
    is_alone: AtomicBool,
}

impl RunningJobs {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<JobId, Arc<RunningJob>>> {
        self.jobs.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters a job, which is under that control. It leaves when the guard is dropped.
    pub(super) fn enter(
        self: &Arc<Self>,
        id: &JobId,
        lease: LeaseId,
        control: Arc<Control>,
    ) -> (Arc<RunningJob>, RunningGuard) {
        let job =
            Arc::new(RunningJob { lease, control, reason: Mutex::new(None), is_computed: AtomicBool::new(false) });
        self.lock().insert(id.clone(), Arc::clone(&job));
        Metric::JobsRunning.change(1.0);
        (Arc::clone(&job), RunningGuard { jobs: Arc::clone(self), id: id.clone(), job })
    }

    /// Tells a job to stop, if this process has it.
    pub(super) fn stop(&self, id: &JobId, reason: StopReason) {
        if let Some(job) = self.lock().get(id) {
            job.stop(reason);
        }
    }

    /// Whether this process has a job by the lease that is on its record.
    pub(super) fn has(&self, record: &JobRecord) -> bool {
        self.lock().get(&record.id).is_some_and(|job| Some(&job.lease) == record.lease.as_ref())
    }

    /// Tells a job to stop that this lease no longer holds.
    pub(super) fn lose(&self, held: &Held) {
        if let Some(job) = self.lock().get(&held.id).filter(|job| job.lease == held.lease) {
            job.stop(StopReason::LeaseLost);
        }
    }

    /// Tells all to stop.
    pub(super) fn stop_all(&self, reason: StopReason) {
        self.lock().values().for_each(|job| job.stop(reason));
    }

    /// How far a job is.
    pub(super) fn progress(&self, id: &JobId) -> Option<StoredProgress> {
        self.lock().get(id).map(|job| progress_of(&job.control))
    }

    /// All of them, as they are reported to the store.
    pub(super) fn held(&self) -> Vec<Held> {
        let held = |(id, job): (&JobId, &Arc<RunningJob>)| Held {
            id: id.clone(),
            lease: job.lease.clone(),
            progress: progress_of(&job.control),
        };
        self.lock().iter().map(held).collect()
    }

    /// How many the engine works on.
    pub(super) fn at_work(&self) -> usize {
        self.lock().values().filter(|job| !job.is_computed.load(Ordering::Relaxed)).count()
    }

    /// Keeps work from beginning ahead of its turn, until the guard is dropped.
    pub(super) fn let_nobody_begin(self: &Arc<Self>) -> AloneGuard {
        self.is_alone.store(true, Ordering::SeqCst);
        AloneGuard(Arc::clone(self))
    }

    /// Whether a job runs by itself.
    pub(super) fn is_alone(&self) -> bool {
        self.is_alone.load(Ordering::SeqCst)
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.lock().len()
    }
}

/// Lets work begin again when it is dropped.
#[derive(Debug)]
pub(super) struct AloneGuard(Arc<RunningJobs>);

impl Drop for AloneGuard {
    fn drop(&mut self) {
        self.0.is_alone.store(false, Ordering::SeqCst);
    }
}

/// Takes the job out when it is dropped.
#[derive(Debug)]
pub(super) struct RunningGuard {
    jobs: Arc<RunningJobs>,
    id: JobId,
    job: Arc<RunningJob>,
}

impl Drop for RunningGuard {
    fn drop(&mut self) {
        let mut jobs = self.jobs.lock();
        // A job that was lost and taken again may be there a second time.
        if jobs.get(&self.id).is_some_and(|job| Arc::ptr_eq(job, &self.job)) {
            jobs.remove(&self.id);
        }
        drop(jobs);
        Metric::JobsRunning.change(-1.0);
    }
}
