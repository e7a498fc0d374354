//! Looking into files and configs for callers who wait for the answer.
//!
//! As many looks are at work at the same time as jobs may run here, each principal has half of them at most, and they draw on the memory that
//! jobs draw on. Files are read when all of that is there, and everything ends when the caller goes away.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, PoisonError, Weak},
    time::Duration,
};

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{Engine, Refusal, memory::MemoryBudget, thread::on_own_thread};
use crate::{
    engine::{Control, Failure, FailureCode, Limits},
    store::Principal,
};

/// The turns that looks take.
#[derive(Debug)]
pub(super) struct Looks {
    all: Arc<Semaphore>,
    per_owner: usize,
    owners: Mutex<BTreeMap<Principal, Weak<Semaphore>>>,
}

/// A look that somebody asks for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Look<'a> {
    /// Who asks.
    pub(super) owner: &'a Principal,
    /// What its thread is called.
    pub(super) thread: &'static str,
    /// What it does, for messages.
    pub(super) what: &'static str,
    /// The memory that it is thought to need.
    pub(super) memory_bytes: u64,
}

/// What a look is done with.
pub(super) struct LookMeans {
    pub(super) engine: Arc<dyn Engine>,
    pub(super) limits: Limits,
    pub(super) memory: MemoryBudget,
    /// How long it may take.
    pub(super) longest: Duration,
}

/// A turn. Dropping it lets the next one begin.
#[derive(Debug)]
struct Turn {
    _of_owner: OwnedSemaphorePermit,
    _of_all: OwnedSemaphorePermit,
}

impl Looks {
    pub(super) fn new(workers: usize) -> Self {
        let all = workers.max(1);
        Self { all: Arc::new(Semaphore::new(all)), per_owner: all.div_ceil(2), owners: Mutex::default() }
    }

    /// Waits for a turn of that owner. Only those wait among all who have one of their owner, so that owners take turns.
    async fn turn(&self, owner: &Principal) -> Option<Turn> {
        let of_owner = self.of_owner(owner).acquire_owned().await.ok()?;
        let of_all = Arc::clone(&self.all).acquire_owned().await.ok()?;
        Some(Turn { _of_owner: of_owner, _of_all: of_all })
    }

    fn of_owner(&self, owner: &Principal) -> Arc<Semaphore> {
        let mut owners = self.owners.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(known) = owners.get(owner).and_then(Weak::upgrade) {
            return known;
        }
        owners.retain(|_, permits| permits.strong_count() > 0);
        let permits = Arc::new(Semaphore::new(self.per_owner));
        owners.insert(owner.clone(), Arc::downgrade(&permits));
        permits
    }

    /// Has the engine look at what `load` reads, on a thread of its own, no longer than a job may take; nothing is read before it is its turn.
    pub(super) async fn look<F: Send + 'static, T: Send + 'static>(
        &self,
        means: LookMeans,
        look: Look<'_>,
        load: impl Future<Output = Result<F, Refusal>>,
        work: impl FnOnce(&F, &dyn Engine, &Limits, &Control) -> Result<T, Failure> + Send + 'static,
    ) -> Result<T, Refusal> {
        let LookMeans { engine, limits, memory, longest } = means;
        let admitted = async {
            let turn = self.turn(look.owner).await;
            (turn, memory.take(look.memory_bytes).await)
        };
        let held = tokio::time::timeout(longest, admitted).await.map_err(|_| Refusal::TooBusy)?;
        let Look { thread, what, .. } = look;
        // Canceled when the caller goes away, so that nobody works for nobody.
        let watched = CancelOnDrop(Arc::default());
        let control = Arc::clone(&watched.0);
        let looked = async {
            let files = load.await?;
            let outcome = on_own_thread(thread, move || {
                // Given back when the thread ends, not when the caller goes away.
                let _held = held;
                work(&files, &*engine, &limits, &control)
            });
            let fault = || Failure::new(FailureCode::Internal, format!("{what} failed because of a fault"));
            Ok(outcome.await.ok().flatten().ok_or_else(fault)??)
        };
        tokio::time::timeout(longest, looked).await.unwrap_or_else(|_| {
            Err(Failure::new(FailureCode::AssetLimitExceeded, format!("{what} took too long"))
                .with_hint("the limit is 'job_timeout'")
                .into())
        })
    }
}

struct CancelOnDrop(Arc<Control>);

impl Drop for CancelOnDrop {
    fn drop(&mut self) {
        self.0.cancel();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn owners_take_turns() {
        let looks = Arc::new(Looks::new(2));
        let [many, one] = ["many", "one"].map(|name| Principal::parse(name).expect("a name"));
        let first = looks.turn(&many).await.expect("a turn");
        let waits = tokio::spawn({
            let (looks, many) = (Arc::clone(&looks), many.clone());
            async move { looks.turn(&many).await }
        });
        tokio::task::yield_now().await;
        assert!(looks.turn(&one).await.is_some(), "another owner does not wait behind who has a turn");
        assert!(!waits.is_finished(), "the same owner does");
        drop(first);
        drop(waits.await.expect("no panic").expect("its turn"));
        drop(looks.of_owner(&one));
        looks.of_owner(&many);
        assert_eq!(looks.owners.lock().expect("not poisoned").len(), 1, "who has gone is forgotten");
    }
}
