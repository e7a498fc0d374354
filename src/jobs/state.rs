//! The life of a job, as a pure function.

use crate::store::JobState;

/// What can happen to a job.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JobEvent {
    /// A worker takes it.
    Start,
    /// Its results are there.
    Succeed,
    /// It cannot give results.
    Fail,
    /// Somebody wants it to stop.
    RequestCancel,
    /// The worker has stopped, as it was asked to.
    Stop,
    /// Its worker is going away, or went away, and another one shall take it.
    Requeue,
}

impl JobEvent {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Start, Self::Succeed, Self::Fail, Self::RequestCancel, Self::Stop, Self::Requeue];
}

/// The state that follows; `None` when the event cannot happen in that state. Final states never change. What was told to
/// stop ends `canceled` unless it was done already.
#[must_use]
pub const fn next_state(state: JobState, event: JobEvent) -> Option<JobState> {
    Some(match (state, event) {
        (JobState::Queued, JobEvent::Start) => JobState::Running,
        (JobState::Queued, JobEvent::RequestCancel) => JobState::Canceled,
        (JobState::Queued, JobEvent::Fail) => JobState::Failed,
        (JobState::Running, JobEvent::RequestCancel) => JobState::Canceling,
        (JobState::Running, JobEvent::Requeue) => JobState::Queued,
        (JobState::Running, JobEvent::Fail) => JobState::Failed,
        (JobState::Running | JobState::Canceling, JobEvent::Succeed) => JobState::Succeeded,
        (JobState::Canceling, JobEvent::RequestCancel) => JobState::Canceling,
        (JobState::Canceling, JobEvent::Stop | JobEvent::Fail | JobEvent::Requeue) => JobState::Canceled,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn final_states_never_change() {
        for state in JobState::ALL.into_iter().filter(|state| state.is_final()) {
            for event in JobEvent::ALL {
                assert_eq!(next_state(state, event), None, "{state:?} on {event:?}");
            }
        }
    }

    #[test]
    fn every_unfinished_state_can_be_canceled_and_can_end() {
        for state in JobState::ALL.into_iter().filter(|state| !state.is_final()) {
            assert!(next_state(state, JobEvent::RequestCancel).is_some(), "{state:?} can be canceled");
            let mut reached = vec![state];
            let mut next = 0;
            while next < reached.len() {
                let found = JobEvent::ALL.into_iter().filter_map(|event| next_state(reached[next], event));
                let new: Vec<_> = found.filter(|state| !reached.contains(state)).collect();
                reached.extend(new);
                next += 1;
            }
            assert!(reached.iter().any(|state| state.is_final()), "{state:?} leads to an end: {reached:?}");
        }
    }

    #[test]
    fn a_canceled_job_never_runs_again() {
        let requeued = next_state(JobState::Canceling, JobEvent::Requeue);
        assert_eq!(requeued, Some(JobState::Canceled), "a crash or a drain while canceling");
    }
}
