//! What jobs of this process run in: one seat for each worker, and a spare one for a job of no batch while jobs of batches keep workers
//! busy. So a batch that has all workers delays nobody else by more than their share of the processor, and when nobody else asks, it
//! loses nothing.
//!
//! A seat is for as long as the engine works, and the memory that goes with it until what came of it is stored. Writing down what came of it waits for the disk, and the next job need not wait with it:
//! as many jobs as there are workers may be about to end beside those that run.

use std::sync::Arc;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::store::Lane;

/// All of them.
#[derive(Debug)]
pub(in crate::jobs) struct Seats {
    workers: Arc<Semaphore>,
    spare: Arc<Semaphore>,
    /// Places for those that are about to end.
    ends: Arc<Semaphore>,
    /// Shared with every job of a batch that runs.
    batches: Arc<()>,
}

/// One of them, and what the job in it takes up.
#[derive(Debug)]
pub(in crate::jobs) struct Seat {
    /// The last lane whose jobs may have it.
    pub(in crate::jobs) last: Lane,
    held: Vec<Held>,
    /// Until the seat is dropped: what the job gave is in memory until it is stored.
    memory: Option<OwnedSemaphorePermit>,
    ends: Arc<Semaphore>,
}

/// What is given back by dropping it.
#[derive(Debug)]
enum Held {
    Permit(#[expect(dead_code, reason = "held, never looked at")] OwnedSemaphorePermit),
    OfBatch(#[expect(dead_code, reason = "held, never looked at")] Arc<()>),
}

impl Seats {
    pub(in crate::jobs) fn new(workers: usize) -> Self {
        let seats = |count| Arc::new(Semaphore::new(count));
        Self { workers: seats(workers), spare: seats(1), ends: seats(workers), batches: Arc::default() }
    }

    /// Waits for that of a worker. No semaphore here is ever closed.
    pub(in crate::jobs) async fn worker(&self) -> Option<Seat> {
        Some(self.seat(Arc::clone(&self.workers).acquire_owned().await.ok()?, Lane::Batch))
    }

    async fn spare(&self) -> Option<Seat> {
        Some(self.seat(Arc::clone(&self.spare).acquire_owned().await.ok()?, Lane::Single))
    }

    /// Waits for that of a worker, or for the spare one where that is given away.
    pub(in crate::jobs) async fn free(&self) -> Option<Seat> {
        // Only who asks here starts jobs, so none begins while this waits.
        let runs_batches = Arc::strong_count(&self.batches) > 1;
        tokio::select! {
            biased;
            seat = self.worker() => seat,
            seat = self.spare(), if runs_batches => seat,
        }
    }

    fn seat(&self, worker: OwnedSemaphorePermit, last: Lane) -> Seat {
        Seat { last, held: vec![Held::Permit(worker)], memory: None, ends: Arc::clone(&self.ends) }
    }

    /// Gives a seat to a job, with the memory that it may have.
    pub(in crate::jobs) fn give(&self, seat: &mut Seat, is_of_batch: bool, memory: OwnedSemaphorePermit) {
        seat.memory = Some(memory);
        seat.held.extend(is_of_batch.then(|| Held::OfBatch(Arc::clone(&self.batches))));
    }
}

impl Seat {
    /// Leaves it to the next job, where not too many are about to end already; to be called when the engine is done. The memory stays taken.
    pub(in crate::jobs) fn leave(&mut self) {
        if let Ok(end) = Arc::clone(&self.ends).try_acquire_owned() {
            self.held = vec![Held::Permit(end)];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn the_next_job_waits_for_the_engine_and_not_for_the_disk() {
        let seats = Seats::new(1);
        let mut first = seats.worker().await.expect("a seat");
        assert_eq!(seats.workers.available_permits(), 0, "the engine works");
        first.leave();
        let mut second = seats.worker().await.expect("the next job has it");
        second.leave();
        assert_eq!(seats.workers.available_permits(), 0, "a disk that is slower than the engine is waited for");
        drop(first);
        drop(second);
        assert_eq!((seats.workers.available_permits(), seats.ends.available_permits()), (1, 1), "all is given back");
    }

    #[tokio::test]
    async fn the_spare_seat_is_there_while_a_batch_runs() {
        let (seats, memory) = (Seats::new(1), Arc::new(Semaphore::new(1)));
        let mut seat = seats.free().await.expect("a worker's");
        assert_eq!(seat.last, Lane::Batch, "any job may have it");
        seats.give(&mut seat, true, Arc::clone(&memory).try_acquire_owned().expect("some"));
        let spare = seats.free().await.expect("the spare one");
        assert_eq!(spare.last, Lane::Single, "no job of a batch may have that");
        drop(spare);
        seat.leave();
        assert_eq!(seats.free().await.expect("the worker's").last, Lane::Batch, "the batch has left it");
        assert_eq!(memory.available_permits(), 0, "what it gave is not stored yet");
        drop(seat);
        assert_eq!(memory.available_permits(), 1, "now it is");
    }
}
