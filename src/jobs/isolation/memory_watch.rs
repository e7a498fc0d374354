//! Who of the engine processes has too much memory in use.
//!
//! Addresses say little of memory, so the parent looks at what each process has in use: one that has more than it may, and the largest of
//! all when they together have more than they may, are ended before the kernel ends somebody of its own choice.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// What each process has in use, as it was last seen.
#[derive(Debug, Default)]
struct Uses(Mutex<BTreeMap<u32, u64>>);

impl Uses {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<u32, u64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Looks at all of them.
#[derive(Debug)]
pub(super) struct MemoryWatch {
    uses: Arc<Uses>,
    most_of_one: u64,
    most_of_all: u64,
}

/// Looks at one of them, until it is dropped.
#[derive(Debug)]
pub(super) struct Watched {
    uses: Arc<Uses>,
    process: u32,
    most_of_one: u64,
    most_of_all: u64,
}

impl MemoryWatch {
    /// Without `most_of_all`, only what one may have is bounded.
    pub(super) fn new(most_of_one: u64, most_of_all: Option<u64>) -> Self {
        Self { uses: Arc::default(), most_of_one, most_of_all: most_of_all.unwrap_or(u64::MAX) }
    }

    pub(super) fn over(&self, process: u32) -> Watched {
        let Self { ref uses, most_of_one, most_of_all } = *self;
        Watched { uses: Arc::clone(uses), process, most_of_one, most_of_all }
    }
}

impl Watched {
    /// Whether it is to be ended.
    pub(super) fn has_too_much(&self) -> bool {
        bytes_in_use(self.process).is_some_and(|bytes| self.is_too_much(bytes))
    }

    fn is_too_much(&self, bytes: u64) -> bool {
        let mut uses = self.uses.lock();
        uses.insert(self.process, bytes);
        let all = uses.values().fold(0, |sum: u64, bytes| sum.saturating_add(*bytes));
        bytes > self.most_of_one || (all > self.most_of_all && uses.values().all(|other| *other <= bytes))
    }
}

impl Drop for Watched {
    fn drop(&mut self) {
        self.uses.lock().remove(&self.process);
    }
}

/// Memory that a process has to itself, where the system tells: the second number of `statm` without the third, which it shares.
#[cfg(target_os = "linux")]
fn bytes_in_use(process: u32) -> Option<u64> {
    let text = std::fs::read_to_string(format!("/proc/{process}/statm")).ok()?;
    let mut pages = text.split(' ').skip(1).map_while(|pages| pages.parse::<u64>().ok());
    let (resident, shared) = (pages.next()?, pages.next()?);
    Some(resident.saturating_sub(shared).saturating_mul(rustix::param::page_size() as u64))
}

#[cfg(not(target_os = "linux"))]
fn bytes_in_use(_: u32) -> Option<u64> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_that_has_too_much_goes_and_of_many_the_largest() {
        let watch = MemoryWatch::new(100, Some(150));
        let (first, second) = (watch.over(1), watch.over(2));
        assert!(!first.is_too_much(100), "as much as one may have");
        assert!(first.is_too_much(101), "more");
        assert!(!first.is_too_much(90), "alone");
        assert!(!second.is_too_much(70), "together too much, but the other one is larger");
        assert!(first.is_too_much(90), "the larger one goes");
        drop(first);
        assert!(!second.is_too_much(99), "and the other one has room");
    }
}
