//! Looking into files and configs for callers who wait for the answer.
//!
//! As many looks are at work at the same time as jobs may run here, each principal has half of them at most, and they draw on the memory that
//! jobs draw on. Files are read when all of that is there, and everything ends when the caller goes away. Who waits for long although their
//! own looks are brief has a spare turn, so that a few with long ones do not hold up all others.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError, Weak},
    time::Duration,
};

use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    time::{Instant, sleep},
};

use super::{Engine, Refusal, memory::MemoryBudget, one_shot::MOMENT, thread::on_own_thread};
use crate::{
    engine::{Control, Failure, FailureCode, Limits},
    store::{BRIEF, Principal},
};

/// The turns that looks take.
#[derive(Debug)]
pub(super) struct Looks {
    all: Arc<Semaphore>,
    /// For who waits for longer than is brief, and is brief.
    spare: Arc<Semaphore>,
    /// How long is brief.
    brief: Duration,
    /// How long who is brief waits for a turn of all before there is the spare one.
    moment: Duration,
    per_owner: usize,
    owners: Arc<Owners>,
}

/// What is known of who looks.
#[derive(Debug, Default)]
struct Owners(Mutex<BTreeMap<Principal, Owner>>);

#[derive(Debug, Default)]
struct Owner {
    permits: Weak<Semaphore>,
    /// What a look is thought to take: rises at once to what one took, and falls by a quarter of the difference.
    cost: Duration,
}

impl Owners {
    /// Those who are remembered although they do not look at the moment.
    const MOST: usize = 1000;

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Principal, Owner>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn cost_of(&self, owner: &Principal) -> Duration {
        self.lock().get(owner).map_or(Duration::ZERO, |known| known.cost)
    }

    fn charge(&self, owner: &Principal, took: Duration) {
        if let Some(known) = self.lock().get_mut(owner) {
            known.cost = took.max((known.cost * 3 + took) / 4);
        }
    }
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
    owner: Principal,
    owners: Arc<Owners>,
    began: Instant,
    _of_owner: OwnedSemaphorePermit,
    _of_all: OwnedSemaphorePermit,
}

impl Drop for Turn {
    fn drop(&mut self) {
        self.owners.charge(&self.owner, self.began.elapsed());
    }
}

impl Looks {
    pub(super) fn new(workers: usize) -> Self {
        let all = workers.max(1);
        let seats = |count| Arc::new(Semaphore::new(count));
        Self {
            all: seats(all),
            spare: seats(1),
            brief: BRIEF,
            moment: MOMENT,
            per_owner: all.div_ceil(2),
            owners: Arc::default(),
        }
    }

    /// Waits for a turn of that owner. Only those wait among all who have one of their owner, so that owners take turns.
    async fn turn(&self, owner: &Principal) -> Option<Turn> {
        let of_owner = self.of_owner(owner).acquire_owned().await.ok()?;
        let is_brief = self.owners.cost_of(owner) <= self.brief;
        let of_all = tokio::select! {
            biased;
            worker = Arc::clone(&self.all).acquire_owned() => worker,
            spare = self.spare_later(), if is_brief => spare,
        };
        let (owner, owners) = (owner.clone(), Arc::clone(&self.owners));
        Some(Turn { owner, owners, began: Instant::now(), _of_owner: of_owner, _of_all: of_all.ok()? })
    }

    async fn spare_later(&self) -> Result<OwnedSemaphorePermit, tokio::sync::AcquireError> {
        sleep(self.moment).await;
        Arc::clone(&self.spare).acquire_owned().await
    }

    fn of_owner(&self, owner: &Principal) -> Arc<Semaphore> {
        let mut owners = self.owners.lock();
        if let Some(known) = owners.get(owner).and_then(|known| known.permits.upgrade()) {
            return known;
        }
        if owners.len() >= Owners::MOST {
            owners.retain(|_, known| known.permits.strong_count() > 0);
        }
        let permits = Arc::new(Semaphore::new(self.per_owner));
        owners.entry(owner.clone()).or_default().permits = Arc::downgrade(&permits);
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
        for number in 0..=Owners::MOST {
            looks.of_owner(&Principal::parse(&format!("caller-{number}")).expect("a name"));
        }
        assert!(looks.owners.lock().len() <= Owners::MOST, "who has gone is forgotten in the end");
    }

    #[tokio::test]
    async fn who_is_brief_need_not_wait_for_who_is_not() {
        const BRIEF: Duration = Duration::from_millis(50);
        let looks = Looks { brief: BRIEF, moment: BRIEF, ..Looks::new(2) };
        let name = |name: &str| Principal::parse(name).expect("a name");
        let long = [looks.turn(&name("mallory")).await, looks.turn(&name("trudy")).await];
        let began = Instant::now();
        drop(looks.turn(&name("carol")).await.expect("the spare turn"));
        assert!(began.elapsed() >= BRIEF, "which is not there at once");
        sleep(BRIEF * 2).await;
        drop(long);
        let others = [looks.turn(&name("bob")).await, looks.turn(&name("dan")).await];
        let again = tokio::time::timeout(BRIEF * 4, looks.turn(&name("mallory"))).await;
        assert!(again.is_err(), "not for who had one for long");
        drop(others);
    }
}
