//! The processor's time that requests of each caller take, and how long callers wait who take more than their share of it.
//!
//! Nobody waits as long as nobody else asks. Where several do, half of the processors are for their requests, the other half for jobs; who has
//! taken more than an equal part of that half waits until the sum of what it took, which fades within a second, is down to that part. What
//! a request costs is measured while it is worked on, and guessed by those before it when it begins, so that many at once count at once.

use std::{
    collections::BTreeMap,
    pin::pin,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use tokio::{sync::Semaphore, time::Instant};

use crate::jobs::Principal;

/// Within which time use fades to a third.
const FADES_SECONDS: f64 = 1.0;
/// What every request costs beside what is measured: its connection, and its questions to the store.
const BASE_SECONDS: f64 = 0.0003;
/// Who has taken less than this lately is not somebody to share with.
const ACTIVE_SECONDS: f64 = 0.002;
/// No request waits longer than this for its turn.
const LONGEST_WAIT: Duration = Duration::from_secs(2);
/// How long a refusal is kept back: as long as it tells its caller to wait. Who asks again at once would be refused all the time.
const REFUSED: Duration = Duration::from_secs(1);
/// How long it is kept back that what somebody shows opens nothing.
const UNKNOWN: Duration = Duration::from_millis(250);
/// Refusals that are kept back at the same time; more are given at once.
const MAX_KEPT_BACK: usize = 512;

/// What callers have taken. Cheap to clone; all clones are the same.
#[derive(Clone, Debug)]
pub struct Turns {
    /// Processors that requests may have in all.
    processors: f64,
    callers: Arc<Mutex<BTreeMap<Principal, Use>>>,
    kept_back: Arc<Semaphore>,
}

/// What a caller has taken.
#[derive(Clone, Copy, Debug)]
struct Use {
    /// In seconds, faded since.
    spent: f64,
    at: Instant,
    /// What one of its requests costs, in seconds.
    of_one: f64,
}

impl Use {
    fn fade(&mut self, now: Instant) {
        self.spent *= (-now.duration_since(self.at).as_secs_f64() / FADES_SECONDS).exp();
        self.at = now;
    }
}

impl Default for Turns {
    fn default() -> Self {
        let processors = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Self {
            processors: processors as f64 * 0.5,
            callers: Arc::default(),
            kept_back: Arc::new(Semaphore::new(MAX_KEPT_BACK)),
        }
    }
}

impl Turns {
    /// Waits until it is the caller's turn, and begins to count what its request takes.
    pub(super) async fn take(&self, caller: &Principal) -> Turn {
        let began = Instant::now();
        loop {
            let wait = self.wait_of(caller, Instant::now()).min(LONGEST_WAIT.saturating_sub(began.elapsed()));
            if wait < Duration::from_millis(1) {
                break;
            }
            tokio::time::sleep(wait).await;
        }
        self.begin(caller, Instant::now())
    }

    fn begin(&self, caller: &Principal, now: Instant) -> Turn {
        let mut callers = self.lock();
        let of_caller = callers.entry(caller.clone()).or_insert(Use { spent: 0.0, at: now, of_one: BASE_SECONDS });
        of_caller.fade(now);
        let guessed = of_caller.of_one;
        of_caller.spent += guessed;
        drop(callers);
        Turn { turns: self.clone(), caller: caller.clone(), guessed, spent: Spent::default() }
    }

    /// Counts what a request took that was guessed to take so long.
    fn end(&self, caller: &Principal, guessed: f64, took: f64, now: Instant) {
        if let Some(of_caller) = self.lock().get_mut(caller) {
            of_caller.fade(now);
            of_caller.spent = (of_caller.spent + took - guessed).max(0.0);
            of_caller.of_one += (took - of_caller.of_one) * 0.1;
        }
    }

    /// Keeps it back for a while that a caller is refused.
    pub(super) async fn keep_back(&self, is_known: bool) {
        if let Ok(_permit) = self.kept_back.try_acquire() {
            tokio::time::sleep(if is_known { REFUSED } else { UNKNOWN }).await;
        }
    }

    fn wait_of(&self, caller: &Principal, now: Instant) -> Duration {
        let mut callers = self.lock();
        callers.values_mut().for_each(|of_caller| of_caller.fade(now));
        callers.retain(|_, of_caller| of_caller.spent > ACTIVE_SECONDS * 0.01);
        let Some(own) = callers.get(caller).map(|of_caller| of_caller.spent) else { return Duration::ZERO };
        let others = callers.iter().filter(|(other, of_other)| *other != caller && of_other.spent > ACTIVE_SECONDS);
        let others = others.count();
        let share = self.processors * FADES_SECONDS / (others + 1) as f64;
        if others == 0 || own <= share {
            return Duration::ZERO;
        }
        Duration::from_secs_f64(FADES_SECONDS * (own / share).ln())
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<Principal, Use>> {
        self.callers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The processor's time that is spent on a request, wherever it is worked on.
#[derive(Clone, Debug, Default)]
pub(super) struct Spent(Arc<AtomicU64>);

impl Spent {
    /// Does work, and counts the time in which it does not wait.
    pub(super) async fn count<F: Future>(&self, work: F) -> F::Output {
        let mut work = pin!(work);
        std::future::poll_fn(|context| {
            let began = std::time::Instant::now();
            let outcome = work.as_mut().poll(context);
            self.0.fetch_add(u64::try_from(began.elapsed().as_nanos()).unwrap_or(u64::MAX), Ordering::Relaxed);
            outcome
        })
        .await
    }

    fn seconds(&self) -> f64 {
        self.0.load(Ordering::Relaxed) as f64 * 1e-9
    }
}

/// A request that is worked on. Dropping it ends the counting.
#[derive(Debug)]
pub(super) struct Turn {
    turns: Turns,
    caller: Principal,
    guessed: f64,
    pub(super) spent: Spent,
}

impl Drop for Turn {
    fn drop(&mut self) {
        self.turns.end(&self.caller, self.guessed, BASE_SECONDS + self.spent.seconds(), Instant::now());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: Duration = Duration::from_millis(1);

    fn name(name: &str) -> Principal {
        Principal::parse(name).expect("a name")
    }

    fn one_processor() -> Turns {
        Turns { processors: 1.0, ..Turns::default() }
    }

    /// A request that takes so many seconds, as soon as it may begin after a time; when it has begun.
    fn ask(turns: &Turns, caller: &Principal, took: f64, mut now: Instant) -> Instant {
        while !turns.wait_of(caller, now).is_zero() {
            now += STEP;
        }
        let turn = turns.begin(caller, now);
        turns.end(caller, turn.guessed, took, now);
        std::mem::forget(turn);
        now
    }

    #[test]
    fn who_is_alone_never_waits() {
        let (turns, ann, now) = (one_processor(), name("ann"), Instant::now());
        for _ in 0..100 {
            assert_eq!(ask(&turns, &ann, 0.5, now), now, "there is nobody to share with");
        }
    }

    #[test]
    fn who_takes_more_than_a_share_waits_and_others_do_not() {
        let (turns, greedy, modest, began) = (one_processor(), name("mallory"), name("carol"), Instant::now());
        let mut now = began;
        for _ in 0..100 {
            assert!(turns.wait_of(&modest, now).is_zero(), "what is left of a share is not taken away");
            ask(&turns, &modest, 0.01, now);
            now = ask(&turns, &greedy, 0.1, now);
        }
        let per_second = 100.0 * 0.1 / (now - began).as_secs_f64();
        assert!((0.3..=0.7).contains(&per_second), "about half of one processor: {per_second}");
    }

    #[test]
    fn many_at_once_count_at_once() {
        let (turns, greedy, modest, now) = (one_processor(), name("mallory"), name("carol"), Instant::now());
        for _ in 0..30 {
            ask(&turns, &greedy, 0.1, now);
        }
        ask(&turns, &modest, 0.2, now);
        let later = ask(&turns, &greedy, 0.1, now);
        let turn = turns.begin(&greedy, later);
        assert!(turns.wait_of(&greedy, later) > STEP * 50, "also before anything of it has been counted");
        std::mem::forget(turn);
    }

    #[tokio::test]
    async fn refusals_are_kept_back_and_not_without_end() {
        let turns = Turns::default();
        let began = Instant::now();
        turns.keep_back(false).await;
        assert!(began.elapsed() >= UNKNOWN, "for a while");
        let _all = turns.kept_back.try_acquire_many(MAX_KEPT_BACK as u32).expect("all of them");
        let began = Instant::now();
        turns.keep_back(true).await;
        assert!(began.elapsed() < REFUSED / 2, "where there are too many, no more wait");
    }

    #[tokio::test]
    async fn what_is_waited_for_does_not_count() {
        let spent = Spent::default();
        spent.count(tokio::time::sleep(Duration::from_millis(200))).await;
        assert!(spent.seconds() < 0.1, "{}", spent.seconds());
        spent.count(async { std::thread::sleep(Duration::from_millis(50)) }).await;
        assert!(spent.seconds() >= 0.05, "what keeps a processor busy does");
    }

    #[test]
    fn who_has_not_asked_for_long_is_forgotten() {
        let (turns, now) = (Turns::default(), Instant::now());
        for number in 0..100 {
            ask(&turns, &name(&format!("caller-{number}")), 0.01, now);
        }
        turns.wait_of(&name("ann"), now + Duration::from_secs(20));
        assert!(turns.lock().is_empty(), "nobody is remembered for ever");
    }
}
