//! Telling those who wait in this process that something has changed. What it is now stands in the store.

use tokio::sync::{Notify, broadcast};

use crate::store::{JobId, JobState};

/// What has changed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Change {
    /// A job came into that state.
    Job(JobId, JobState),
    /// Nobody knows.
    Anything,
}

impl Change {
    /// Whether it may be one of that job.
    pub(super) fn concerns(&self, id: &JobId) -> bool {
        match self {
            Self::Job(other, _) => other == id,
            Self::Anything => true,
        }
    }

    /// Whether it may be the end of any job.
    pub(super) const fn is_end(&self) -> bool {
        match self {
            Self::Job(_, state) => state.is_final(),
            Self::Anything => true,
        }
    }

    /// Whether it may be the end of that job.
    pub(super) fn may_end(&self, id: &JobId) -> bool {
        match self {
            Self::Job(other, state) => other == id && state.is_final(),
            Self::Anything => true,
        }
    }
}

/// Who is told.
#[derive(Debug)]
pub(super) struct Changes {
    all: broadcast::Sender<Change>,
    /// One who waits for jobs to arrive: the task that claims them.
    arrivals: Notify,
}

impl Default for Changes {
    fn default() -> Self {
        /// Waiters that fall this far behind look the record up instead of missing a change.
        const KEPT: usize = 1024;
        Self { all: broadcast::Sender::new(KEPT), arrivals: Notify::new() }
    }
}

impl Changes {
    /// Hears every change from now on.
    pub(super) fn subscribe(&self) -> broadcast::Receiver<Change> {
        self.all.subscribe()
    }

    /// The next arrival, which is remembered from this call on.
    pub(super) fn arrival(&self) -> tokio::sync::futures::Notified<'_> {
        self.arrivals.notified()
    }

    /// Tells that a job came into a state.
    pub(super) fn announce(&self, id: &JobId, state: JobState) {
        if state == JobState::Queued {
            self.arrivals.notify_one();
        }
        self.tell(Change::Job(id.clone(), state));
    }

    /// Tells that anything may have changed.
    pub(super) fn announce_anything(&self) {
        self.tell(Change::Anything);
        self.arrivals.notify_one();
    }

    fn tell(&self, change: Change) {
        // Nobody waiting is no failure.
        let _ = self.all.send(change);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_end_ends_and_what_nobody_knows_may_be_one() {
        let [own, other] = [(); 2].map(|()| JobId::new());
        let change = |id: &JobId, state| Change::Job(id.clone(), state);
        assert!(change(&own, JobState::Failed).may_end(&own), "it has ended");
        assert!(!change(&own, JobState::Running).may_end(&own), "it has begun");
        assert!(!change(&other, JobState::Failed).may_end(&own), "another one has ended");
        assert!(change(&own, JobState::Running).concerns(&own) && !change(&other, JobState::Running).concerns(&own));
        assert!(Change::Anything.may_end(&own) && Change::Anything.concerns(&own));
    }
}
