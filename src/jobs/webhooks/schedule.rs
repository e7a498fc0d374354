//! When a delivery that failed is tried again.

use std::time::Duration;

/// The longest that a receiver may ask to be left alone.
const LONGEST: Duration = Duration::from_hours(24);

/// How long to wait before a delivery is tried again that has been retried that often before; `None` when that was often enough.
/// `asked` is what the receiver asked for, and `chance` is from 0 to 1: it spreads attempts that failed together by a fifth to both sides.
pub(super) fn delay(delays: &[Duration], retries: u64, asked: Option<Duration>, chance: f64) -> Option<Duration> {
    let planned = delays.get(usize::try_from(retries).ok()?)?;
    let spread = planned.mul_f64(0.8 + 0.4 * chance.clamp(0.0, 1.0));
    Some(spread.max(asked.unwrap_or_default().min(LONGEST)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn attempts_grow_rarer_and_come_to_an_end() {
        let delays = [5, 300, 1800].map(seconds);
        let waits: Vec<_> = (0..5).map(|retries| delay(&delays, retries, None, 0.5)).collect();
        assert_eq!(waits, [Some(delays[0]), Some(delays[1]), Some(delays[2]), None, None], "as planned, then no more");
        assert_eq!(delay(&delays, 1, None, 0.0), Some(seconds(240)), "a fifth earlier at most");
        assert_eq!(delay(&delays, 1, None, 1.0), Some(seconds(360)), "a fifth later at most");
        assert_eq!(delay(&[], 0, None, 0.5), None, "some things are tried once");
    }

    #[test]
    fn a_receiver_is_left_alone_for_as_long_as_it_asks_within_reason() {
        let delays = [5, 300].map(seconds);
        assert_eq!(delay(&delays, 0, Some(seconds(60)), 0.5), Some(seconds(60)), "longer than planned");
        assert_eq!(delay(&delays, 1, Some(seconds(60)), 0.5), Some(seconds(300)), "not sooner than planned");
        assert_eq!(delay(&delays, 0, Some(seconds(u64::MAX)), 0.5), Some(LONGEST), "not for ever");
        assert_eq!(delay(&delays, 2, Some(seconds(60)), 0.5), None, "nor more often");
    }
}
