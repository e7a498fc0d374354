//! How many threads an engine process works with: the cores are shared out among the processes that are at work, since threads that
//! wait for one another cost more than they bring where there is no core for them.

use std::{
    io,
    sync::atomic::{AtomicUsize, Ordering},
};

use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::jobs::thread::STACK_BYTES;

/// How many processes are at work, as their parent counts them.
#[derive(Debug, Default)]
pub(super) struct AtWork(AtomicUsize);

/// Until it is dropped, one more is.
#[derive(Debug)]
pub(super) struct OneAtWork<'a>(&'a AtWork);

impl AtWork {
    /// Counts one more. Gives the threads that it may have.
    pub(super) fn begin(&self) -> (OneAtWork<'_>, usize) {
        let busy = self.0.fetch_add(1, Ordering::Relaxed) + 1;
        (OneAtWork(self), share(rayon::current_num_threads(), busy))
    }
}

impl Drop for OneAtWork<'_> {
    fn drop(&mut self) {
        self.0.0.fetch_sub(1, Ordering::Relaxed);
    }
}

/// What each of `busy` has of `all` threads: all, or a power of two, so that a child does not make threads anew for each small change.
fn share(all: usize, busy: usize) -> usize {
    match all / busy.max(1) {
        0 | 1 => 1,
        share if share == all => all,
        share => 1 << share.ilog2(),
    }
}

/// The threads of a child: those that it worked with last, and before them those of another number, since processes that take turns are
/// given one number and another over and over. The others sleep.
#[derive(Debug, Default)]
pub(super) struct Threads {
    last: Option<ThreadPool>,
    before: Option<ThreadPool>,
}

impl Threads {
    /// That many.
    ///
    /// # Errors
    /// When the system has no more.
    pub(super) fn of(&mut self, count: usize) -> io::Result<&ThreadPool> {
        let count = count.max(1);
        let has_count = |pool: &ThreadPool| pool.current_num_threads() == count;
        if !self.last.as_ref().is_some_and(has_count) {
            std::mem::swap(&mut self.last, &mut self.before);
        }
        let pool = match self.last.take_if(|pool| has_count(pool)) {
            Some(pool) => pool,
            None => {
                let builder = ThreadPoolBuilder::new().num_threads(count).stack_size(STACK_BYTES);
                builder.thread_name(|_| "engine".to_owned()).build().map_err(io::Error::other)?
            }
        };
        Ok(self.last.insert(pool))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cores_are_shared_out() {
        assert_eq!((1..=4).map(|busy| share(8, busy)).collect::<Vec<_>>(), [8, 4, 2, 2], "by powers of two");
        assert_eq!((share(2, 1), share(2, 2), share(2, 9), share(1, 1)), (2, 1, 1, 1), "and nobody has none");
        assert_eq!(share(6, 1), 6, "who is alone has all");
    }

    #[test]
    fn a_child_keeps_its_threads_for_when_it_is_given_as_many_again() {
        let mut threads = Threads::default();
        let mut thread_of = |count: usize| {
            let pool = threads.of(count).expect("threads");
            assert_eq!(pool.install(rayon::current_num_threads), count.max(1), "the work sees that many");
            let mut ids = pool.broadcast(|_| format!("{:?}", std::thread::current().id()));
            ids.sort_unstable();
            ids
        };
        let (two, one) = (thread_of(2), thread_of(1));
        assert_eq!([thread_of(2), thread_of(2), thread_of(1)], [two.clone(), two.clone(), one.clone()]);
        assert_eq!(thread_of(0), one, "at least one");
        thread_of(3);
        assert_eq!(thread_of(1), one, "the two numbers used last are kept");
        assert_ne!(thread_of(2), two, "and no more");
    }

    #[test]
    fn who_is_done_gives_back() {
        let at_work = AtWork::default();
        let (first, _) = at_work.begin();
        let (second, share_of_two) = at_work.begin();
        assert_eq!(share_of_two, share(rayon::current_num_threads(), 2), "two");
        drop(first);
        drop(second);
        assert_eq!(at_work.begin().1, rayon::current_num_threads(), "all, when nobody else is at work");
    }
}
