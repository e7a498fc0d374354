//! Following what happens to jobs: as it comes, and from where somebody left off.
//!
//! What happened is in the store, so a stream goes on at any process; the notices of changes only say when to look. A stream tells
//! every event once and in order, or says with [`Told::Reset`] that some are gone.

use std::{collections::VecDeque, time::Duration};

use tokio::{sync::broadcast, time::Instant};

use super::{Jobs, Refusal, changes::Change, streams::OpenStream};
use crate::store::{BatchId, EventReach, EventRecord, JobId, JobRecord, JobState, Principal, StoredProgress};

/// Read from the store at once.
const MAX_AT_ONCE: usize = 100;
/// How often to look, in case a notice of another process was missed.
const LOOK_AGAIN: Duration = Duration::from_secs(2);
/// How often to look how far a job is that runs.
const LOOK_AT_PROGRESS: Duration = Duration::from_millis(500);
/// What happens within this time after a look is told together: many jobs of one principal do not make every stream ask for each.
const GATHER: Duration = Duration::from_millis(50);

/// What a stream tells.
#[derive(Clone, Debug, PartialEq)]
pub enum Told {
    /// A job came into a state.
    Happened(EventRecord),
    /// A job that runs is that far. Has no number: who comes back hears the next one.
    Progress(JobId, StoredProgress),
    /// Events are gone that the caller has not heard of, and the stream goes on behind that number. The state of jobs is to be asked for.
    Reset {
        /// What the next event comes after.
        number: u64,
        /// Why.
        reason: &'static str,
    },
    /// The stream ends, and is to be taken up again. The reason is one of a closed set: `shutting_down`, `time_is_over`,
    /// `unavailable`.
    Bye(&'static str),
}

/// Which events somebody wants to hear of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Followed {
    /// Those of one job, to its end.
    Job(JobId),
    /// Those of the jobs of one batch, until all have ended.
    Batch(BatchId),
    /// Those of all jobs of the caller.
    Everything,
}

impl Followed {
    fn has(&self, event: &EventRecord) -> bool {
        match self {
            Self::Job(_) | Self::Everything => true,
            Self::Batch(id) => event.batch.as_ref().is_some_and(|place| place.batch == *id),
        }
    }
}

/// Tells what happens to the jobs of one principal.
#[derive(Debug)]
pub struct EventStream {
    jobs: Jobs,
    owner: Principal,
    followed: Followed,
    /// The number of the newest event that was read.
    position: u64,
    waiting: VecDeque<Told>,
    /// The last progress that was told.
    progress: Option<StoredProgress>,
    changes: broadcast::Receiver<Change>,
    ends_at: Instant,
    has_ended: bool,
    _open: OpenStream,
}

impl Jobs {
    /// Follows events behind number `after`. Without a number, those of a job or batch begin with its first, and those of everything with the
    /// next. `None` when nothing will come any more: the job or batch has ended, and the caller knows.
    ///
    /// # Errors
    /// When the caller has no such job or batch, or too many streams, or the service is going down.
    pub async fn follow(
        &self,
        owner: &Principal,
        followed: Followed,
        after: Option<u64>,
    ) -> Result<Option<EventStream>, Refusal> {
        if self.is_draining() {
            return Err(Refusal::Draining);
        }
        // Before looking, so that no change is missed in between.
        let changes = self.0.changes.subscribe();
        let open = self.0.streams.open(owner, self.0.settings.max_event_streams)?;
        let reach = self.0.store.records().event_reach(owner).await?;
        let mut stream = EventStream {
            jobs: self.clone(),
            owner: owner.clone(),
            position: 0,
            waiting: VecDeque::new(),
            progress: None,
            changes,
            ends_at: Instant::now() + self.0.settings.event_stream_period.0,
            has_ended: false,
            _open: open,
            followed,
        };
        stream.position = match (&stream.followed, after) {
            (_, Some(after)) => after,
            (Followed::Job(_), None) => 0,
            (Followed::Batch(id), None) => {
                self.0.store.records().first_event_of_batch(id).await?.map_or(reach.removed, |first| first - 1)
            }
            (Followed::Everything, None) => reach.last,
        };
        if after.is_some() {
            stream.check_gap(reach);
        }
        if let Followed::Job(id) = &stream.followed {
            let job = self.record(owner, id).await?;
            let events = self.0.store.records().job_events_after(id, stream.position, MAX_AT_ONCE).await?;
            if events.is_empty() && job.state.is_final() {
                if after.is_some() && stream.waiting.is_empty() {
                    return Ok(None);
                }
                stream.end_with_reset();
            }
        }
        if let Followed::Batch(id) = &stream.followed {
            self.batch(owner, id).await?;
            if after.is_some() {
                stream.look().await?;
                if stream.has_ended && stream.waiting.is_empty() {
                    return Ok(None);
                }
            }
        }
        Ok(Some(stream))
    }
}

impl EventStream {
    /// What comes next; waits for it. `None` when the stream has ended.
    pub async fn next(&mut self) -> Option<Told> {
        loop {
            if let Some(told) = self.waiting.pop_front() {
                return Some(told);
            }
            if self.has_ended {
                return None;
            }
            if let Err(error) = self.look().await {
                tracing::error!(%error, "an event stream could not be read on");
                self.end_with(Told::Bye("unavailable"));
            } else if !self.waiting.is_empty() || self.has_ended {
                // Told in the next round.
            } else if self.jobs.is_draining() {
                self.end_with(Told::Bye("shutting_down"));
            } else if Instant::now() >= self.ends_at {
                self.end_with(Told::Bye("time_is_over"));
            } else {
                self.wait().await;
            }
        }
    }

    fn end_with(&mut self, told: Told) {
        self.waiting.push_back(told);
        self.has_ended = true;
    }

    /// The job has ended, and its last event is no longer kept.
    fn end_with_reset(&mut self) {
        let number = self.position;
        self.waiting.clear();
        self.end_with(Told::Reset { number, reason: "the job has ended, and its events are no longer kept" });
    }

    /// Says so where events are gone that come after the position, or the position is one that has never been.
    fn check_gap(&mut self, reach: EventReach) {
        let reason = if self.position > reach.last {
            "there is no event of that number"
        } else if self.position < reach.removed {
            "events behind that number are no longer kept"
        } else {
            return;
        };
        self.position = reach.last;
        self.waiting.push_back(Told::Reset { number: reach.last, reason });
    }

    async fn look(&mut self) -> Result<(), Refusal> {
        let records = self.jobs.0.store.records();
        let id = match &self.followed {
            Followed::Job(id) => id,
            Followed::Everything => return self.look_at_all().await.map(|_| ()),
            Followed::Batch(id) => {
                // The batch first: when it says that all jobs have ended, the events that say so are there too.
                let has_ended = match self.jobs.batch(&self.owner, id).await {
                    Ok(batch) => batch.state().is_final(),
                    Err(Refusal::NotFound { .. }) => true,
                    Err(refusal) => return Err(refusal),
                };
                let has_read_all = self.look_at_all().await?;
                self.has_ended |= has_ended && has_read_all;
                return Ok(());
            }
        };
        // The record first: when it says that the job has ended, the event that says so is there too.
        let job = self.jobs.record(&self.owner, id).await;
        let events = records.job_events_after(id, self.position, MAX_AT_ONCE).await?;
        let has_news = !events.is_empty();
        self.take(events);
        match job {
            Ok(job) if job.state.is_final() && !has_news => self.end_with_reset(),
            Ok(job) if !has_news => self.look_at_progress(job),
            Err(Refusal::NotFound { .. }) if !has_news => self.end_with_reset(),
            Ok(_) | Err(Refusal::NotFound { .. }) => {}
            Err(refusal) => return Err(refusal),
        }
        Ok(())
    }

    /// Reads on among the events of the caller, to the next that are followed or to the newest. Gives whether it came to the newest.
    async fn look_at_all(&mut self) -> Result<bool, Refusal> {
        loop {
            let records = self.jobs.0.store.records();
            let reach = records.event_reach(&self.owner).await?;
            if reach.last == self.position {
                return Ok(true);
            }
            let events = records.events_after(&self.owner, self.position, MAX_AT_ONCE).await?;
            self.check_gap(reach);
            let has_read_all = events.len() < MAX_AT_ONCE;
            self.take(events);
            if has_read_all || !self.waiting.is_empty() {
                return Ok(has_read_all);
            }
        }
    }

    fn take(&mut self, events: Vec<EventRecord>) {
        let position = self.position;
        for event in events.into_iter().filter(|event| event.number > position) {
            self.position = event.number;
            self.has_ended |= matches!(self.followed, Followed::Job(_)) && event.state.is_final();
            if self.followed.has(&event) {
                self.waiting.push_back(Told::Happened(event));
            }
        }
    }

    fn look_at_progress(&mut self, job: JobRecord) {
        let progress = self.jobs.0.running.progress(&job.id).or(job.progress);
        let progress = progress.filter(|_| job.state == JobState::Running);
        if progress != self.progress {
            self.progress.clone_from(&progress);
            self.waiting.extend(progress.map(|progress| Told::Progress(job.id, progress)));
        }
    }

    /// Waits until something may have changed.
    async fn wait(&mut self) {
        let look_again = match self.followed {
            Followed::Job(_) => LOOK_AT_PROGRESS,
            Followed::Batch(_) | Followed::Everything => LOOK_AGAIN,
        };
        let (followed, jobs, changes) = (&self.followed, &self.jobs, &mut self.changes);
        let concerns = |change: &Change| match followed {
            Followed::Job(own) => change.concerns(own),
            Followed::Batch(_) | Followed::Everything => true,
        };
        let changed = async {
            // Falling behind may have hidden a change, so it counts as one.
            while matches!(changes.recv().await, Ok(change) if !concerns(&change) && !jobs.is_draining()) {}
        };
        let look = self.ends_at.min(Instant::now() + look_again);
        let has_changed = tokio::time::timeout_at(look, changed).await.is_ok();
        if has_changed && !matches!(followed, Followed::Job(_)) && !jobs.is_draining() {
            tokio::time::sleep(GATHER).await;
        }
    }
}
