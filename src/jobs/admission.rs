//! Who may join the queue: it is bounded by count and by bytes.
//!
//! The queue is in the store, so its length is asked for there. A long one is not counted for every job that comes: then the last
//! answer stands for a moment, with what this process has added since. Several processes may so exceed the bounds by what the
//! others added in that moment.

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
    pub(super) fn new(most_jobs: u64, most_bytes: u64) -> Self {
        Self { most: QueueDepth { jobs: most_jobs, bytes: most_bytes }, known: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        // Nothing panics while it is held; were it to, the numbers are still right.
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a job of no size would be taken now. For refusing before a body is read.
    pub(super) async fn check_room(&self, records: &Records) -> Result<(), Refusal> {
        self.look(records).await?;
        self.room_for(&self.lock(), QueueDepth { jobs: 1, bytes: 0 })
    }

    /// Keeps room for a job of that many bytes until its record is written.
    pub(super) async fn reserve(self: &Arc<Self>, records: &Records, bytes: u64) -> Result<Reservation, Refusal> {
        self.look(records).await?;
        let size = QueueDepth { jobs: 1, bytes };
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
        Metric::JobsQueued.set([], depth.jobs as f64);
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
            known.depth.jobs > COUNTED_EVERY_TIME && known.at.is_some_and(|at| at.elapsed() < STANDS_FOR)
        };
        if !stands {
            self.refresh(records).await?;
        }
        Ok(())
    }

    fn room_for(&self, known: &Known, size: QueueDepth) -> Result<(), Refusal> {
        let before = plus(known.depth, known.reserved);
        let after = plus(before, size);
        let refusal = if after.jobs > self.most.jobs {
            Refusal::QueueFull { limit: "queued_jobs", most: self.most.jobs, actual: after.jobs }
        } else if after.bytes > self.most.bytes && before.jobs > 0 {
            // A job larger than the whole queue may still wait alone; the limits of files bound it.
            Refusal::QueueFull { limit: "queued_bytes", most: self.most.bytes, actual: after.bytes }
        } else {
            return Ok(());
        };
        Metric::AdmissionRejected.count([("reason", "queue_full".to_owned())], 1);
        Err(refusal)
    }
}

fn plus(one: QueueDepth, other: QueueDepth) -> QueueDepth {
    QueueDepth { jobs: one.jobs.saturating_add(other.jobs), bytes: one.bytes.saturating_add(other.bytes) }
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
        if self.is_filled {
            known.depth = plus(known.depth, self.size);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(jobs: u64, bytes: u64) -> Known {
        Known { depth: QueueDepth { jobs, bytes }, ..Known::default() }
    }

    #[test]
    fn the_queue_is_bounded_by_count_and_bytes_and_a_large_job_may_wait_alone() {
        let admission = Admission::new(2, 100);
        let room = |known: &Known, bytes: u64| admission.room_for(known, QueueDepth { jobs: 1, bytes });
        assert!(room(&known(1, 60), 40).is_ok(), "both bounds are reached, none is passed");
        assert!(matches!(room(&known(1, 60), 41), Err(Refusal::QueueFull { limit: "queued_bytes", .. })), "bytes");
        assert!(matches!(room(&known(2, 0), 0), Err(Refusal::QueueFull { limit: "queued_jobs", .. })), "count");
        assert!(room(&known(0, 0), 500).is_ok(), "alone, a large one may wait");
    }

    #[test]
    fn a_reservation_counts_until_it_is_dropped() {
        let admission = Arc::new(Admission::new(1, 100));
        let size = QueueDepth { jobs: 1, bytes: 10 };
        admission.lock().reserved = size;
        let reservation = Reservation { admission: Arc::clone(&admission), size, is_filled: false };
        assert!(admission.room_for(&admission.lock(), size).is_err(), "the room is taken");
        drop(reservation);
        assert!(admission.room_for(&admission.lock(), size).is_ok(), "and given back");
    }
}
