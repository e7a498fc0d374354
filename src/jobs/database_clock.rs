//! Notices when somebody sets the clock of the database, by which the leases of jobs run out.

use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

use jiff::Timestamp;

/// What the database's clock did between two looks at it, beside going on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Jump {
    /// Forward by that much: leases seem to have run out that have not.
    Forward(Duration),
    /// Back by that much: leases seem to run for longer than they do.
    Back(Duration),
}

/// The clock as it was last seen, beside one that nobody can set.
#[derive(Debug, Default)]
pub(super) struct DatabaseClock(Mutex<Option<(Instant, Timestamp)>>);

impl DatabaseClock {
    /// Takes a look; gives by how much it has jumped since the one before.
    pub(super) fn look(&self, seen_at: Instant, now: Timestamp) -> Option<Jump> {
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let (before, then) = last.replace((seen_at, now))?;
        drop(last);
        let (passed, shown) = (seen_at.saturating_duration_since(before), now.duration_since(then));
        let (is_back, shown) = (shown.is_negative(), shown.unsigned_abs());
        Some(match is_back {
            true => Jump::Back(shown + passed),
            false if shown < passed => Jump::Back(passed - shown),
            false => Jump::Forward(shown - passed),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_more_or_less_than_the_time_that_passed_is_a_jump() {
        let (clock, began) = (DatabaseClock::default(), Instant::now());
        let look = |passed: u64, shown: i64| {
            let shown = Timestamp::from_second(1_000_000 + shown).expect("a time");
            clock.look(began + Duration::from_secs(passed), shown)
        };
        let seconds = Duration::from_secs;
        assert_eq!(look(0, 0), None, "nothing to compare with");
        assert_eq!(look(2, 2), Some(Jump::Forward(seconds(0))), "as it should");
        assert_eq!(look(4, 3604), Some(Jump::Forward(seconds(3600))), "an hour forward");
        assert_eq!(look(6, 6), Some(Jump::Back(seconds(3600))), "and back");
        assert_eq!(look(16, 7), Some(Jump::Back(seconds(9))), "slow");
    }
}
