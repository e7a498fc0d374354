//! Work that begins while the records of its job are still being written.
//!
//! Where somebody waits for a job whose files have just arrived, most of what is left before a worker has it is waiting for the disk. With
//! a worker free and nobody else waiting, the engine may as well begin: the worker that claims the job takes the work over. Nothing is
//! decided here. A job that is refused, canceled or lost takes its work with it, and a job without a head start is run all the same.
//!
//! Only the engine's own processes are given a head start: a file that brings one of them down harms nobody, even while no record says
//! that it was tried. And only where no other process could claim the job.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use tokio::sync::{OwnedSemaphorePermit, oneshot};

use crate::{
    engine::{Control, Failure},
    jobs::EngineResult,
    store::JobId,
};

/// Work that has begun.
#[derive(Debug)]
pub(in crate::jobs) struct HeadStart {
    pub(in crate::jobs) control: Arc<Control>,
    /// What it takes of the memory that jobs may have.
    pub(in crate::jobs) memory: OwnedSemaphorePermit,
    pub(in crate::jobs) work: BegunWork,
}

/// An engine that is at work.
#[derive(Debug)]
pub(in crate::jobs) struct BegunWork {
    /// Since when.
    pub(in crate::jobs) at: Instant,
    /// What will come of it; `None` when the engine panicked.
    pub(in crate::jobs) outcome: oneshot::Receiver<Option<Result<EngineResult, Failure>>>,
}

/// The work of this process that no worker has taken over yet, by job.
#[derive(Debug, Default)]
pub(in crate::jobs) struct HeadStarts(Mutex<BTreeMap<JobId, HeadStart>>);

impl HeadStarts {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<JobId, HeadStart>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn add(self: &Arc<Self>, id: &JobId, begun: HeadStart) -> Begun {
        self.lock().insert(id.clone(), begun);
        Begun { head_starts: Arc::clone(self), id: id.clone() }
    }

    /// The work on a job, for the worker that has claimed it.
    pub(in crate::jobs) fn take_over(&self, id: &JobId) -> Option<HeadStart> {
        self.lock().remove(id)
    }

    pub(in crate::jobs) fn len(&self) -> usize {
        self.lock().len()
    }
}

/// Stops the work when it is dropped, unless a worker has taken it over.
#[derive(Debug)]
pub(in crate::jobs) struct Begun {
    head_starts: Arc<HeadStarts>,
    id: JobId,
}

impl Drop for Begun {
    fn drop(&mut self) {
        if let Some(begun) = self.head_starts.take_over(&self.id) {
            begun.control.cancel();
        }
    }
}

#[cfg(test)]
mod tests {
    use tokio::sync::Semaphore;

    use super::*;

    fn begun() -> (Arc<HeadStarts>, JobId, Arc<Control>, Begun) {
        let (head_starts, id, control) = (Arc::<HeadStarts>::default(), JobId::new(), Arc::<Control>::default());
        let memory = Arc::new(Semaphore::new(1)).try_acquire_owned().expect("a permit");
        let work = BegunWork { at: Instant::now(), outcome: oneshot::channel().1 };
        let guard = head_starts.add(&id, HeadStart { control: Arc::clone(&control), memory, work });
        (head_starts, id, control, guard)
    }

    #[test]
    fn what_nobody_takes_over_is_stopped() {
        let (head_starts, _, control, guard) = begun();
        drop(guard);
        assert!(control.check().is_err(), "the engine is told");
        assert_eq!(head_starts.len(), 0, "and nothing is left");
    }

    #[test]
    fn what_a_worker_has_taken_over_goes_on_when_the_caller_goes_away() {
        let (head_starts, id, control, guard) = begun();
        let taken = head_starts.take_over(&id).expect("it is there");
        drop(guard);
        assert!(control.check().is_ok(), "it is the worker's");
        assert!(head_starts.take_over(&id).is_none(), "once");
        drop(taken);
    }
}
