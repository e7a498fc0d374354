//! The time of day, which tests may move by hand.

use std::{
    sync::{
        Arc, LazyLock,
        atomic::{AtomicI64, Ordering},
    },
    time::{Duration, Instant},
};

use jiff::Timestamp;

/// Seconds since the first call, from a clock that never goes back: what the engine measures its phases with.
#[must_use]
pub fn monotonic_seconds() -> f64 {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGIN.elapsed().as_secs_f64()
}

/// Tells the time of day. Lengths of time inside one process are measured with `Instant`, not with this.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// Milliseconds that the clock is ahead of the machine's.
    ahead_milliseconds: Arc<AtomicI64>,
}

impl Clock {
    /// The machine's clock.
    #[must_use]
    pub fn system() -> Self {
        Self::default()
    }

    /// Now, to the millisecond, which is what records keep.
    #[must_use]
    #[expect(clippy::disallowed_methods, reason = "the one place that reads the time of day")]
    pub fn now(&self) -> Timestamp {
        let milliseconds = Timestamp::now().as_millisecond() + self.ahead_milliseconds.load(Ordering::Relaxed);
        Timestamp::from_millisecond(milliseconds).unwrap_or(Timestamp::MAX)
    }

    /// A point in time that far from now; not later than what records can keep, which is in the year 9999.
    #[must_use]
    pub fn after(&self, period: Duration) -> Timestamp {
        let latest = Timestamp::from_second(Timestamp::MAX.as_second()).unwrap_or(Timestamp::MAX);
        self.now().checked_add(period).map_or(latest, |time| time.min(latest))
    }

    /// Moves this clock and all its clones forward, so that a test need not wait.
    pub fn advance(&self, period: Duration) {
        let milliseconds = i64::try_from(period.as_millis()).unwrap_or(i64::MAX);
        self.ahead_milliseconds.fetch_add(milliseconds, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_very_far_off_can_still_be_kept_in_milliseconds() {
        let latest = Clock::system().after(Duration::from_secs(u64::MAX));
        assert_eq!(Timestamp::from_millisecond(latest.as_millisecond()).ok(), Some(latest), "read back as it was");
    }
}
