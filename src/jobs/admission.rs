//! Who may join the queue: it is bounded by count and by bytes, and for jobs of batches, which wait behind the others, by a count of
//! their own.
//!
//! The queue is in the store, so its length is asked for there. It is not counted for every job that comes: while there is much room, and
//! also where the queue is long, the last answer stands for a moment, with what this process has added since. Several processes may so
//! exceed the bounds by what the others added in that moment.

use std::{
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use jiff::Timestamp;

use super::Refusal;
use crate::{
    store::{QueueDepth, Records},
    telemetry::Metric,
};

/// Counting up to this many takes less than a millisecond.
const COUNTED_EVERY_TIME: u64 = 1000;
/// How long the last answer about a longer queue stands.
const STANDS_FOR: Duration = Duration::from_secs(1);

#[derive(Debug, Default)]
struct Known {
    depth: QueueDepth,
    at: Option<Instant>,
    /// On their way into the store.
    reserved: QueueDepth,
}

/// The way into the queue.
#[derive(Debug)]
pub(super) struct Admission {
    most: QueueDepth,
    /// Held for a few instructions, never across an await.
    known: Mutex<Known>,
}

impl Admission {
    pub(super) fn new(most: QueueDepth) -> Self {
        Self { most, known: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        // Nothing panics while it is held; were it to, the numbers are still right.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether that much would be taken now. For refusing before a body is read.
    pub(super) async fn check_room(&self, records: &Records, size: QueueDepth) -> Result<(), Refusal> {
        self.look(records).await?;
        self.room_for(&self.lock(), size)
    }

    /// Keeps room for that much until its records are written.
    pub(super) async fn reserve(self: &Arc<Self>, records: &Records, size: QueueDepth) -> Result<Reservation, Refusal> {
        self.look(records).await?;
        let mut known = self.lock();
        self.room_for(&known, size)?;
        known.reserved = plus(known.reserved, size);
        Ok(Reservation { admission: Arc::clone(self), size, is_filled: false })
    }

    /// Asks the store how much waits.
    pub(super) async fn refresh(&self, records: &Records) -> Result<QueueDepth, Refusal> {
        let depth = records.queue_depth().await?;
        let mut known = self.lock();
        (known.depth, known.at) = (depth, Some(Instant::now()));
        drop(known);
        Metric::JobsQueued.set([], (depth.jobs + depth.batch_jobs) as f64);
        Ok(depth)
    }

    /// Measures how much waits and for how long, for those who watch.
    pub(super) async fn observe(&self, records: &Records, now: Timestamp) -> Result<(), Refusal> {
        self.refresh(records).await?;
        let since = records.oldest_queued().await?;
        let waited = since.map_or(0, |since| (now.as_millisecond() - since.as_millisecond()).max(0));
        Metric::JobsOldestQueued.set([], waited as f64 / 1e3);
        Ok(())
    }

    async fn look(&self, records: &Records) -> Result<(), Refusal> {
        let stands = {
            let known = self.lock();
            let is_long = known.depth.jobs + known.depth.batch_jobs > COUNTED_EVERY_TIME;
            let is_young = known.at.is_some_and(|at| at.elapsed() < STANDS_FOR);
            is_young && (is_long || self.is_half_empty(&known))
        };
        if !stands {
            self.refresh(records).await?;
        }
        Ok(())
    }

    /// Jobs that have ended since are still counted, so there is at least that much room.
    fn is_half_empty(&self, known: &Known) -> bool {
        let QueueDepth { jobs, bytes, batch_jobs } = plus(known.depth, known.reserved);
        jobs <= self.most.jobs / 2 && bytes <= self.most.bytes / 2 && batch_jobs <= self.most.batch_jobs / 2
    }

    fn room_for(&self, known: &Known, size: QueueDepth) -> Result<(), Refusal> {
        let before = plus(known.depth, known.reserved);
        let after = plus(before, size);
        // What is larger than the whole queue may still wait alone; other limits bound it.
        let refusal = if size.jobs > 0 && after.jobs > self.most.jobs {
            Refusal::QueueFull { limit: "queued_jobs", most: self.most.jobs, actual: after.jobs }
        } else if size.batch_jobs > 0 && after.batch_jobs > self.most.batch_jobs && before.batch_jobs > 0 {
            Refusal::QueueFull { limit: "queued_batch_jobs", most: self.most.batch_jobs, actual: after.batch_jobs }
        } else if size.jobs > 0 && after.bytes > self.most.bytes && before.jobs > 0 {
            Refusal::QueueFull { limit: "queued_bytes", most: self.most.bytes, actual: after.bytes }
        } else {
            return Ok(());
        };
        Metric::AdmissionRejected.count([("reason", "queue_full".to_owned())], 1);
        Err(refusal)
    }
}

fn plus(one: QueueDepth, other: QueueDepth) -> QueueDepth {
    QueueDepth {
        jobs: one.jobs.saturating_add(other.jobs),
        bytes: one.bytes.saturating_add(other.bytes),
        batch_jobs: one.batch_jobs.saturating_add(other.batch_jobs),
    }
}

/// Room in the queue. Dropping it gives the room back.
#[derive(Debug)]
pub(super) struct Reservation {
    admission: Arc<Admission>,
    size: QueueDepth,
    is_filled: bool,
}

impl Reservation {
    /// The job is in the store.
    pub(super) fn fill(mut self) {
        self.is_filled = true;
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        let mut known = self.admission.lock();
        known.reserved.jobs -= self.size.jobs;
        known.reserved.bytes -= self.size.bytes;
        known.reserved.batch_jobs -= self.size.batch_jobs;
        if self.is_filled {
            known.depth = plus(known.depth, self.size);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOST: QueueDepth = QueueDepth { jobs: 2, bytes: 100, batch_jobs: 5 };

    fn known(jobs: u64, bytes: u64) -> Known {
        Known { depth: QueueDepth { jobs, bytes, batch_jobs: 0 }, ..Known::default() }
    }

    #[test]
    fn the_queue_is_bounded_by_count_and_bytes_and_a_large_job_may_wait_alone() {
        let admission = Admission::new(MOST);
        let room = |known: &Known, bytes: u64| admission.room_for(known, QueueDepth { jobs: 1, bytes, batch_jobs: 0 });
        assert!(room(&known(1, 60), 40).is_ok(), "both bounds are reached, none is passed");
        assert!(matches!(room(&known(1, 60), 41), Err(Refusal::QueueFull { limit: "queued_bytes", .. })), "bytes");
        assert!(matches!(room(&known(2, 0), 0), Err(Refusal::QueueFull { limit: "queued_jobs", .. })), "count");
        assert!(room(&known(0, 0), 500).is_ok(), "alone, a large one may wait");
    }

    #[test]
    fn batches_and_single_jobs_do_not_take_room_from_one_another() {
        let admission = Admission::new(MOST);
        let batch = |jobs: u64| QueueDepth { batch_jobs: jobs, ..QueueDepth::default() };
        assert!(admission.room_for(&known(2, 100), batch(5)).is_ok(), "the queue of single jobs is full");
        let full = Known { depth: batch(5), ..Known::default() };
        let refused = admission.room_for(&full, batch(1));
        assert!(matches!(refused, Err(Refusal::QueueFull { limit: "queued_batch_jobs", .. })), "{refused:?}");
        assert!(admission.room_for(&full, QueueDepth { jobs: 2, ..QueueDepth::default() }).is_ok(), "a single job");
        assert!(admission.room_for(&known(0, 0), batch(9)).is_ok(), "a large batch may wait alone");
    }

    #[test]
    fn a_reservation_counts_until_it_is_dropped() {
        let admission = Arc::new(Admission::new(QueueDepth { jobs: 1, ..MOST }));
        let size = QueueDepth { jobs: 1, bytes: 10, batch_jobs: 0 };
        admission.lock().reserved = size;
        let reservation = Reservation { admission: Arc::clone(&admission), size, is_filled: false };
        assert!(admission.room_for(&admission.lock(), size).is_err(), "the room is taken");
        drop(reservation);
        assert!(admission.room_for(&admission.lock(), size).is_ok(), "and given back");
    }
}
