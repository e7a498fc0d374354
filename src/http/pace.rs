//! How fast bytes pass between the service and a caller, while it is the caller who is waited for.

use std::{
    future::Future,
    pin::Pin,
    task::{Context, Poll},
    time::Duration,
};

use tokio::time::{Instant, Sleep};

/// Watches one direction of one connection. Time in which the service itself is busy does not count.
#[derive(Debug)]
pub(super) struct Pace {
    /// The longest pause, and the period over which the rate is measured.
    period: Duration,
    bytes_per_second: f64,
    sleep: Pin<Box<Sleep>>,
    waiting_since: Option<Instant>,
    waited: Duration,
    passed: u64,
}

impl Pace {
    /// At least `bytes_per_second` over every `period` of waiting, and no pause that is longer than that.
    pub(super) fn new(period: Duration, bytes_per_second: u64) -> Self {
        Self {
            period,
            bytes_per_second: bytes_per_second as f64,
            sleep: Box::pin(tokio::time::sleep(period)),
            waiting_since: None,
            waited: Duration::ZERO,
            passed: 0,
        }
    }

    /// The longest pause.
    pub(super) const fn period(&self) -> Duration {
        self.period
    }

    /// Nothing passes at the moment. Ready when that has lasted too long, or `end` has come.
    pub(super) fn poll_wait(&mut self, context: &mut Context<'_>, end: Option<Instant>) -> Poll<()> {
        if self.waiting_since.is_none() {
            let now = Instant::now();
            self.waiting_since = Some(now);
            let pause = now + self.period;
            self.sleep.as_mut().reset(end.map_or(pause, |end| end.min(pause)));
        }
        self.sleep.as_mut().poll(context)
    }

    /// Bytes have passed. Gives whether they are enough.
    pub(super) fn pass(&mut self, bytes: usize) -> bool {
        self.waited += self.waiting_since.take().map_or(Duration::ZERO, |since| since.elapsed());
        self.passed += bytes as u64;
        if self.waited < self.period {
            return true;
        }
        let is_enough = self.passed as f64 >= self.bytes_per_second * self.waited.as_secs_f64();
        (self.waited, self.passed) = (Duration::ZERO, 0);
        is_enough
    }
}

#[cfg(test)]
mod tests {
    use std::future::poll_fn;

    use super::*;

    const PERIOD: Duration = Duration::from_millis(500);
    const PAUSE: Duration = Duration::from_millis(50);

    /// Waits for the other side for so long, unless that is too long.
    async fn wait(pace: &mut Pace, lasts: Duration) -> Result<(), ()> {
        let too_long = poll_fn(|context| pace.poll_wait(context, None));
        tokio::time::timeout(lasts, too_long).await.map_or(Ok(()), |()| Err(()))
    }

    #[tokio::test]
    async fn pauses_and_trickles_end_and_a_busy_service_does_not() {
        let mut pace = Pace::new(PERIOD, 1000);
        assert_eq!(wait(&mut pace, PERIOD * 4).await, Err(()), "a pause");

        let mut pace = Pace::new(PERIOD, 1000);
        let mut trickled = 0;
        while wait(&mut pace, PAUSE).await == Ok(()) && pace.pass(1) {
            trickled += 1;
        }
        assert!((2..10).contains(&trickled), "a few bytes are too slow as soon as it can be told, after {trickled}");

        let mut pace = Pace::new(PERIOD, 1000);
        for _ in 0..15 {
            assert_eq!(wait(&mut pace, PAUSE).await, Ok(()), "no pause");
            assert!(pace.pass(1000), "as fast as it has to be");
        }
        for _ in 0..3 {
            tokio::time::sleep(PERIOD / 2).await;
            assert!(pace.pass(1), "nobody was waited for");
        }
    }
}
