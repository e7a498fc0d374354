//! What jobs of this process run in: one seat for each worker, and a spare one. While jobs of batches keep workers busy, it is for a job of
//! no batch; while any job keeps a worker for longer than a moment, it is for a job of a caller whose jobs are brief. So who has all workers
//! for long delays nobody else by more than their share of the processor, and when nobody else asks, loses nothing.
//!
//! A seat is for as long as the engine works, and the memory that goes with it until what came of it is stored. Writing down what came of it waits for the disk, and the next job need not wait with it:
//! as many jobs as there are workers may be about to end beside those that run.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::Instant,
};

use crate::store::{Lane, Wanted};

/// After that long, a worker counts as kept: those who wait for it and are brief get the spare seat. Jobs of small files are done by then.
pub(in crate::jobs) const MOMENT: Duration = Duration::from_millis(50);

/// All of them.
#[derive(Debug)]
pub(in crate::jobs) struct Seats {
    workers: Arc<Semaphore>,
    spare: Arc<Semaphore>,
    /// Places for those that are about to end.
    ends: Arc<Semaphore>,
    /// Shared with every job of a batch that runs.
    batches: Arc<()>,
    taken: Arc<Taken>,
    /// How long a worker is taken at most before the spare seat is given away.
    moment: Duration,
}

/// Since when seats of workers are taken, by number.
#[derive(Debug, Default)]
struct Taken(Mutex<(u64, BTreeMap<u64, Instant>)>);

impl Taken {
    fn lock(&self) -> MutexGuard<'_, (u64, BTreeMap<u64, Instant>)> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn add(self: &Arc<Self>) -> Held {
        let mut taken = self.lock();
        taken.0 += 1;
        let number = taken.0;
        taken.1.insert(number, Instant::now());
        Held::Since(Since { number, taken: Arc::clone(self) })
    }

    /// Waits until one has been taken for that long; for ever, where none is taken.
    async fn one_for(&self, period: Duration) {
        // The numbers grow with time.
        let first = self.lock().1.first_key_value().map(|(_, since)| *since);
        match first {
            Some(since) => tokio::time::sleep_until(since + period).await,
            None => std::future::pending().await,
        }
    }
}

/// That one is taken, until this is dropped.
#[derive(Debug)]
struct Since {
    number: u64,
    taken: Arc<Taken>,
}

impl Drop for Since {
    fn drop(&mut self) {
        self.taken.lock().1.remove(&self.number);
    }
}

/// One of them, and what the job in it takes up.
#[derive(Debug)]
pub(in crate::jobs) struct Seat {
    /// The jobs that may have it.
    pub(in crate::jobs) wanted: Wanted,
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
    Since(#[expect(dead_code, reason = "held, never looked at")] Since),
}

impl Seats {
    pub(in crate::jobs) fn new(workers: usize) -> Self {
        let seats = |count| Arc::new(Semaphore::new(count));
        Self {
            workers: seats(workers),
            spare: seats(1),
            ends: seats(workers),
            batches: Arc::default(),
            taken: Arc::default(),
            moment: MOMENT,
        }
    }

    /// Waits for that of a worker. No semaphore here is ever closed.
    pub(in crate::jobs) async fn worker(&self) -> Option<Seat> {
        Some(self.seat(Arc::clone(&self.workers).acquire_owned().await.ok()?, Lane::Batch.into()))
    }

    async fn spare(&self, is_brief: bool) -> Option<Seat> {
        let wanted = Wanted { last: Lane::Single, is_brief };
        Some(self.seat(Arc::clone(&self.spare).acquire_owned().await.ok()?, wanted))
    }

    /// Waits for that of a worker, or for the spare one where that is given away.
    pub(in crate::jobs) async fn free(&self) -> Option<Seat> {
        // Only who asks here starts jobs, so none begins while this waits.
        let runs_batches = Arc::strong_count(&self.batches) > 1;
        tokio::select! {
            biased;
            seat = self.worker() => seat,
            seat = self.spare(false), if runs_batches => seat,
            seat = async { self.taken.one_for(self.moment).await; self.spare(true).await } => seat,
        }
    }

    fn seat(&self, worker: OwnedSemaphorePermit, wanted: Wanted) -> Seat {
        Seat { wanted, held: vec![Held::Permit(worker)], memory: None, ends: Arc::clone(&self.ends) }
    }

    /// Gives a seat to a job, with the memory that it may have.
    pub(in crate::jobs) fn give(&self, seat: &mut Seat, is_of_batch: bool, memory: OwnedSemaphorePermit) {
        seat.memory = Some(memory);
        seat.held.extend((seat.wanted.last == Lane::Batch).then(|| self.taken.add()));
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
        assert_eq!(seat.wanted, Lane::Batch.into(), "any job may have it");
        seats.give(&mut seat, true, Arc::clone(&memory).try_acquire_owned().expect("some"));
        let spare = seats.free().await.expect("the spare one");
        assert_eq!(spare.wanted, Lane::Single.into(), "no job of a batch may have that");
        drop(spare);
        seat.leave();
        assert_eq!(seats.free().await.expect("the worker's").wanted, Lane::Batch.into(), "the batch has left it");
        assert_eq!(memory.available_permits(), 0, "what it gave is not stored yet");
        drop(seat);
        assert_eq!(memory.available_permits(), 1, "now it is");
    }

    #[tokio::test]
    async fn the_spare_seat_is_for_brief_jobs_while_a_long_one_runs() {
        const MOMENT: Duration = Duration::from_millis(100);
        let (seats, memory) = (Seats { moment: MOMENT, ..Seats::new(1) }, Arc::new(Semaphore::new(2)));
        let mut seat = seats.free().await.expect("a worker's");
        seats.give(&mut seat, false, Arc::clone(&memory).try_acquire_owned().expect("some"));
        assert!(tokio::time::timeout(MOMENT / 2, seats.free()).await.is_err(), "it may be brief itself");
        let mut spare = seats.free().await.expect("the spare one");
        assert_eq!(spare.wanted, Wanted { last: Lane::Single, is_brief: true }, "for who does the same to nobody");
        seats.give(&mut spare, false, Arc::clone(&memory).try_acquire_owned().expect("some"));
        seat.leave();
        let next = seats.free().await.expect("the worker's");
        assert_eq!(next.wanted, Lane::Batch.into(), "any job may have that one");
        assert!(tokio::time::timeout(MOMENT * 2, seats.free()).await.is_err(), "none is taken for long any more");
    }
}
