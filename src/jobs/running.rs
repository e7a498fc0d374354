//! The jobs that workers of this process have, and how to stop them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use crate::{
    engine::{Control, Progress},
    store::JobId,
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
}

/// A job that a worker has.
#[derive(Debug)]
pub(super) struct RunningJob {
    /// Shared with the engine.
    pub(super) control: Arc<Control>,
    reason: Mutex<Option<StopReason>>,
}

impl Default for RunningJob {
    fn default() -> Self {
        Self { control: Arc::new(Control::with_clock(monotonic_seconds)), reason: Mutex::new(None) }
    }
}

impl RunningJob {
    /// Tells it to stop.
    pub(super) fn stop(&self, reason: StopReason) {
        self.reason.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
        self.control.cancel();
    }

    /// Why it was told to stop.
    pub(super) fn stop_reason(&self) -> Option<StopReason> {
        *self.reason.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// All of them, by id.
#[derive(Debug, Default)]
pub(super) struct RunningJobs(Mutex<BTreeMap<JobId, Arc<RunningJob>>>);

impl RunningJobs {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<JobId, Arc<RunningJob>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Enters a job. It leaves when the guard is dropped.
    pub(super) fn enter(self: &Arc<Self>, id: &JobId) -> (Arc<RunningJob>, RunningGuard) {
        let job = Arc::new(RunningJob::default());
        self.lock().insert(id.clone(), Arc::clone(&job));
        Metric::JobsRunning.change(1.0);
        (job, RunningGuard { jobs: Arc::clone(self), id: id.clone() })
    }

    /// Tells a job to stop. Gives whether it was there.
    pub(super) fn stop(&self, id: &JobId, reason: StopReason) -> bool {
        self.lock().get(id).map(|job| job.stop(reason)).is_some()
    }

    /// Tells all to stop.
    pub(super) fn stop_all(&self, reason: StopReason) {
        self.lock().values().for_each(|job| job.stop(reason));
    }

    /// How far a job is.
    pub(super) fn progress(&self, id: &JobId) -> Option<Progress> {
        self.lock().get(id).map(|job| job.control.progress())
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.lock().len()
    }
}

/// Takes the job out when it is dropped.
#[derive(Debug)]
pub(super) struct RunningGuard {
    jobs: Arc<RunningJobs>,
    id: JobId,
}

impl Drop for RunningGuard {
    fn drop(&mut self) {
        self.jobs.lock().remove(&self.id);
        Metric::JobsRunning.change(-1.0);
    }
}
