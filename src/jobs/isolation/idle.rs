//! Engine processes that wait for a request: so many at most, and not for ever.

use std::{
    mem,
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// How long one waits that nobody needs. Starting another one takes a few hundredths of a second.
const LONGEST: Duration = Duration::from_secs(30);

/// Those that wait, the one that has waited longest first.
#[derive(Debug)]
pub(super) struct Idle<P> {
    most: usize,
    waiting: Mutex<Vec<(Instant, P)>>,
}

impl<P> Idle<P> {
    pub(super) const fn new(most: usize) -> Self {
        Self { most, waiting: Mutex::new(Vec::new()) }
    }

    /// The one that has waited the shortest time, of those that are preferred where there are any.
    pub(super) fn take(&self, is_preferred: impl Fn(&P) -> bool) -> Option<P> {
        let mut waiting = self.lock();
        let place = waiting.iter().rposition(|(_, process)| is_preferred(process)).or(waiting.len().checked_sub(1))?;
        Some(waiting.remove(place).1)
    }

    /// Has one wait, unless there are enough that do.
    pub(super) fn put(&self, process: P) {
        let mut waiting = self.lock();
        if waiting.len() < self.most {
            waiting.push((Instant::now(), process));
        } else {
            // Ending it takes a while, and the others need not wait for that.
            drop(waiting);
            drop(process);
        }
    }

    /// Ends those that have waited too long, but for one, so that whoever comes next finds one.
    pub(super) fn tidy(&self) {
        let mut waiting = self.lock();
        let newest = waiting.pop();
        let (old, kept) = mem::take(&mut *waiting).into_iter().partition(|(since, _)| since.elapsed() > LONGEST);
        *waiting = kept;
        waiting.extend(newest);
        drop(waiting);
        drop::<Vec<_>>(old);
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Vec<(Instant, P)>> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn so_many_wait_and_the_old_ones_end() {
        let idle = Idle::new(3);
        for process in 0..5 {
            idle.put(process);
        }
        assert_eq!(idle.lock().len(), 3, "no more than that");
        let long_ago = Instant::now().checked_sub(LONGEST * 2).expect("a time");
        for (since, process) in idle.lock().iter_mut() {
            *since = if *process == 1 { Instant::now() } else { long_ago };
        }
        idle.tidy();
        assert_eq!(
            [idle.take(|_| false), idle.take(|_| false), idle.take(|_| false)],
            [Some(2), Some(1), None],
            "the newest stays, and the young"
        );
    }

    #[test]
    fn who_is_preferred_comes_first() {
        let idle = Idle::new(4);
        (0..4).for_each(|process| idle.put(process));
        assert_eq!(idle.take(|process| process % 2 == 0), Some(2), "the newest of them");
        assert_eq!(idle.take(|process| process % 2 == 0), Some(0));
        assert_eq!(idle.take(|process| process % 2 == 0), Some(3), "else the newest of all");
    }
}
