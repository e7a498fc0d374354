//! What waits for a worker: first in, first out, bounded by count and by bytes.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tokio::sync::Semaphore;

use super::Refusal;
use crate::{store::JobId, telemetry::Metric};

#[derive(Debug)]
struct Entry {
    id: JobId,
    bytes: u64,
}

#[derive(Debug, Default)]
struct Waiting {
    entries: VecDeque<Entry>,
    /// Entries and reservations.
    count: u64,
    /// Their bytes.
    bytes: u64,
}

/// The queue.
#[derive(Debug)]
pub(super) struct Queue {
    most_jobs: u64,
    most_bytes: u64,
    /// Held for a few instructions, never across an await.
    waiting: Mutex<Waiting>,
    /// One permit per entry, and per entry that was taken out of the middle.
    arrivals: Semaphore,
}

impl Queue {
    pub(super) fn new(most_jobs: u64, most_bytes: u64) -> Self {
        Self { most_jobs, most_bytes, waiting: Mutex::default(), arrivals: Semaphore::new(0) }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        // Nothing panics while it is held; were it to, the numbers are still right.
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether a job of no size would be taken now. For refusing before a body is read.
    pub(super) fn check_room(&self) -> Result<(), Refusal> {
        self.room_for(&self.lock(), 0)
    }

    /// Keeps room for a job.
    pub(super) fn reserve(self: &Arc<Self>, bytes: u64) -> Result<Reservation, Refusal> {
        let mut waiting = self.lock();
        self.room_for(&waiting, bytes)?;
        waiting.count += 1;
        waiting.bytes += bytes;
        Ok(Reservation { queue: Arc::clone(self), bytes, is_open: true })
    }

    fn room_for(&self, waiting: &Waiting, bytes: u64) -> Result<(), Refusal> {
        let (count, bytes) = (waiting.count + 1, waiting.bytes.saturating_add(bytes));
        let refusal = if count > self.most_jobs {
            Refusal::QueueFull { limit: "queued_jobs", most: self.most_jobs, actual: count }
        } else if bytes > self.most_bytes && waiting.count > 0 {
            // A job larger than the whole queue may still wait alone; the limits of files bound it.
            Refusal::QueueFull { limit: "queued_bytes", most: self.most_bytes, actual: bytes }
        } else {
            return Ok(());
        };
        Metric::AdmissionRejected.count([("reason", "queue_full".to_owned())], 1);
        Err(refusal)
    }

    /// Adds a job that was acknowledged before, room or not: nothing acknowledged is ever lost.
    pub(super) fn push_acknowledged(&self, id: JobId, bytes: u64) {
        let mut waiting = self.lock();
        waiting.count += 1;
        waiting.bytes += bytes;
        self.append(waiting, id, bytes);
    }

    fn append(&self, mut waiting: MutexGuard<'_, Waiting>, id: JobId, bytes: u64) {
        waiting.entries.push_back(Entry { id, bytes });
        drop(waiting);
        Metric::JobsQueued.change(1.0);
        self.arrivals.add_permits(1);
    }

    /// Takes the oldest job, when there is one.
    pub(super) async fn pop(&self) -> JobId {
        loop {
            let permit = self.arrivals.acquire().await.expect("the semaphore is never closed");
            permit.forget();
            let mut waiting = self.lock();
            if let Some(entry) = waiting.entries.pop_front() {
                Self::account_removal(&mut waiting, entry.bytes);
                return entry.id;
            }
        }
    }

    /// Takes a job out of the middle. Gives whether it was there.
    pub(super) fn remove(&self, id: &JobId) -> bool {
        let mut waiting = self.lock();
        let Some(place) = waiting.entries.iter().position(|entry| entry.id == *id) else { return false };
        if let Some(entry) = waiting.entries.remove(place) {
            Self::account_removal(&mut waiting, entry.bytes);
        }
        true
    }

    fn account_removal(waiting: &mut Waiting, bytes: u64) {
        waiting.count -= 1;
        waiting.bytes -= bytes;
        Metric::JobsQueued.change(-1.0);
    }

    /// How many jobs are before this one, plus one.
    pub(super) fn position(&self, id: &JobId) -> Option<u64> {
        self.lock().entries.iter().position(|entry| entry.id == *id).map(|place| place as u64 + 1)
    }

    /// How many wait.
    pub(super) fn len(&self) -> usize {
        self.lock().entries.len()
    }
}

/// Room in the queue. Dropping it gives the room back.
#[derive(Debug)]
pub(super) struct Reservation {
    queue: Arc<Queue>,
    bytes: u64,
    is_open: bool,
}

impl Reservation {
    /// Puts the job there.
    pub(super) fn fill(mut self, id: JobId) {
        self.is_open = false;
        self.queue.append(self.queue.lock(), id, self.bytes);
    }
}

impl Drop for Reservation {
    fn drop(&mut self) {
        if self.is_open {
            let mut waiting = self.queue.lock();
            waiting.count -= 1;
            waiting.bytes -= self.bytes;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_queue_is_bounded_by_count_and_bytes_and_keeps_order() {
        let queue = Arc::new(Queue::new(2, 100));
        let (first, second) = (JobId::new(), JobId::new());
        queue.reserve(60).expect("room").fill(first.clone());
        assert!(
            matches!(queue.reserve(60), Err(Refusal::QueueFull { limit: "queued_bytes", .. })),
            "too many bytes together"
        );
        let reservation = queue.reserve(40).expect("room");
        assert!(
            matches!(queue.check_room(), Err(Refusal::QueueFull { limit: "queued_jobs", .. })),
            "a reservation counts"
        );
        drop(reservation);
        queue.reserve(40).expect("given back").fill(second.clone());
        assert_eq!(queue.position(&second), Some(2), "it is second");
        assert_eq!(queue.pop().await, first, "first in, first out");
        assert!(queue.remove(&second), "taken out");
        assert!(queue.reserve(500).is_ok(), "alone, a large one may wait");
    }

    #[tokio::test]
    async fn what_was_taken_out_of_the_middle_wakes_nobody_for_nothing() {
        let queue = Arc::new(Queue::new(10, 100));
        let (first, second) = (JobId::new(), JobId::new());
        queue.push_acknowledged(first.clone(), 1);
        queue.remove(&first);
        queue.push_acknowledged(second.clone(), 1);
        assert_eq!(queue.pop().await, second, "the stale arrival is skipped");
        assert_eq!(queue.len(), 0, "nothing is left");
    }
}
