//! Random commands on the records, against a model that is a map, with faults on the way: a call may fail before it did anything,
//! fail after it did everything, or take its time. After a failure the record must be as before or as after, and nothing between.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::Duration,
};

use futures::future::BoxFuture;
use jiff::Timestamp;
use retargetd::store::{
    Added, AfterCrash, Claim, Ended, Faults, GiveBack, JobId, JobRecord, JobState, Lane, LeaseId, Moment, Records,
    StoreError,
};

use super::{
    dice::Dice,
    records::{HOUR, asset, end, job},
    support::{Postgres, count_of},
};

/// One call in eight fails, half of them after the fact; one in sixteen takes its time.
#[derive(Debug)]
struct Unlucky(Dice);

impl Faults for Unlucky {
    fn at(&self, _: Moment) -> BoxFuture<'_, Result<(), StoreError>> {
        Box::pin(async {
            match self.0.roll(16) {
                0 => Err(StoreError::Unreadable { record: String::new(), reason: "a fault of the test".to_owned() }),
                1 => {
                    tokio::time::sleep(Duration::from_millis(1)).await;
                    Ok(())
                }
                _ => Ok(()),
            }
        })
    }
}

/// What the model knows of a job.
#[derive(Clone, Debug, PartialEq)]
struct Known {
    state: JobState,
    lease: Option<LeaseId>,
    attempt: u32,
    crashes: u32,
}

impl From<&JobRecord> for Known {
    fn from(job: &JobRecord) -> Self {
        Self { state: job.state, lease: job.lease.clone(), attempt: job.attempt, crashes: job.crashes }
    }
}

struct Script {
    /// Without faults: to see what is.
    truth: Records,
    /// With faults: to do things.
    records: Records,
    dice: Dice,
    jobs: BTreeMap<JobId, Known>,
    /// Those that were there when somebody died.
    suspects: BTreeSet<JobId>,
    faults_seen: u64,
}

impl Script {
    async fn seen(&self, id: &JobId) -> Option<Known> {
        self.truth.job(id).await.expect("reads").as_ref().map(Known::from)
    }

    fn any(&self, states: &[JobState]) -> Option<(JobId, Known)> {
        let fitting: Vec<_> = self.jobs.iter().filter(|(_, job)| states.contains(&job.state)).collect();
        let (id, job) = *fitting.get(self.dice.roll(fitting.len().max(1) as u64) as usize)?;
        Some((id.clone(), job.clone()))
    }

    /// Compares a job with what it must be when `done` (known, or unknown after a fault), and goes on from what is.
    async fn settle(
        &mut self,
        id: &JobId,
        before: Option<Known>,
        after: Option<Known>,
        done: Result<bool, StoreError>,
    ) {
        let seen = self.seen(id).await;
        match done {
            Ok(true) => assert_eq!(seen, after, "{id} was changed"),
            Ok(false) => assert_eq!(seen, before, "{id} was not changed"),
            Err(_) => {
                self.faults_seen += 1;
                assert!(seen == before || seen == after, "{id} is {seen:?}, neither {before:?} nor {after:?}");
            }
        }
        match seen {
            Some(seen) => self.jobs.insert(id.clone(), seen),
            None => self.jobs.remove(id),
        };
    }

    async fn step(&mut self) {
        match self.dice.roll(12) {
            0..=2 => self.add().await,
            3..=5 => self.claim().await,
            6..=7 => self.finish().await,
            8 => self.give_back().await,
            9 => self.cancel().await,
            10 => self.crash().await,
            _ => self.meddle().await,
        }
    }

    async fn add(&mut self) {
        let owner = ["ann", "bob"][self.dice.roll(2) as usize];
        let file = self.truth.add_asset(&asset(owner, "aa")).await.expect("writes").0;
        let new = job(&file, self.dice.roll(3) as i32);
        let done = self.records.add_job(&new).await.map(|added| added == Added::New);
        self.settle(&new.id, None, Some(Known::from(&new)), done).await;
    }

    async fn claim(&mut self) {
        let lease = LeaseId::new();
        let waits = self.jobs.values().any(|job| job.state == JobState::Queued);
        let taken = match self.records.claim_job(&lease, HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await {
            Ok(Claim::Job(job) | Claim::Suspect(job)) => Some(*job),
            Ok(other) => {
                assert!(!waits, "there are jobs, but a claim gives {other:?}");
                None
            }
            // The lease tells whether it was done.
            Err(_) => {
                self.faults_seen += 1;
                self.truth.leased(&lease).await.expect("reads")
            }
        };
        let Some(taken) = taken else { return };
        let before = self.jobs[&taken.id].clone();
        assert_eq!(before.state, JobState::Queued, "only what waits is given out");
        let after = Known { state: JobState::Running, lease: Some(lease), attempt: before.attempt + 1, ..before };
        self.settle(&taken.id, None, Some(after), Ok(true)).await;
    }

    async fn finish(&mut self) {
        let Some((id, before)) = self.any(&[JobState::Running, JobState::Canceling]) else { return };
        let after = Known { state: JobState::Succeeded, ..before.clone() };
        let from = (before.state, before.lease.as_ref());
        let done =
            self.records.finish_job(&id, from, &end(JobState::Succeeded, Vec::new())).await.map(Ended::is_written);
        assert_ne!(done.as_ref().ok(), Some(&false), "the holder can always end it");
        self.settle(&id, Some(before.clone()), Some(after), done).await;
    }

    async fn give_back(&mut self) {
        let Some((id, before)) = self.any(&[JobState::Running, JobState::Canceling]) else { return };
        let lease = before.lease.clone().expect("who runs has a lease");
        let after = Known { state: JobState::Queued, lease: None, attempt: before.attempt - 1, ..before.clone() };
        let done = self.records.give_back(&id, &lease, GiveBack::Drained).await;
        if let Ok(done) = done {
            assert_eq!(done, before.state == JobState::Running, "unless it was told to stop");
        }
        let after = if before.state == JobState::Running { after } else { before.clone() };
        self.settle(&id, Some(before), Some(after), done).await;
    }

    async fn cancel(&mut self) {
        let Some((id, before)) = self.any(&[JobState::Queued, JobState::Running]) else { return };
        let (done, state) = if before.state == JobState::Queued {
            let end = end(JobState::Canceled, Vec::new());
            let done = self.records.finish_job(&id, (JobState::Queued, None), &end).await;
            (done.map(Ended::is_written), JobState::Canceled)
        } else {
            (self.records.request_cancel(&id).await, JobState::Canceling)
        };
        self.settle(&id, Some(before.clone()), Some(Known { state, ..before }), done).await;
    }

    /// Everybody who has a job dies.
    async fn crash(&mut self) {
        let decide = |job: &JobRecord, _: bool| match job.state {
            JobState::Canceling => AfterCrash::End(Box::new(end(JobState::Canceled, Vec::new()))),
            _ => AfterCrash::Requeue,
        };
        let done = self.records.take_from_lost_workers(1000, true, decide).await.map(|_| true);
        let held: Vec<_> = self.jobs.iter().filter(|(_, job)| job.lease.is_some() && !job.state.is_final()).collect();
        let held: Vec<_> = held.into_iter().map(|(id, job)| (id.clone(), job.clone())).collect();
        let is_one = held.len() == 1;
        for (id, before) in held {
            // Nothing but a job that was alone can have been it; who was there when several died is suspected from then on.
            let was_alone = is_one && !self.suspects.contains(&id);
            let crashes = before.crashes + u32::from(was_alone);
            let after = match before.state {
                JobState::Canceling => Known { state: JobState::Canceled, crashes, ..before.clone() },
                _ => Known { state: JobState::Queued, lease: None, crashes, ..before.clone() },
            };
            let done = done.as_ref().map(|done| *done).map_err(|_| StoreError::Locked(String::new()));
            self.settle(&id, Some(before), Some(after), done).await;
            if self.jobs.get(&id).is_some_and(|job| job.state == JobState::Queued) {
                self.suspects.insert(id);
            }
        }
    }

    /// Somebody tries what is not theirs: nothing may change, whatever the answer.
    async fn meddle(&mut self) {
        let Some((id, before)) = self.any(&JobState::ALL) else { return };
        let stranger = LeaseId::new();
        let end = end(JobState::Succeeded, Vec::new());
        for state in [JobState::Running, JobState::Canceling, JobState::Succeeded] {
            let done = self.records.finish_job(&id, (state, Some(&stranger)), &end).await;
            assert!(!done.is_ok_and(Ended::is_written), "a stranger ends nothing");
        }
        assert_ne!(self.records.give_back(&id, &stranger, GiveBack::Drained).await.ok(), Some(true), "nor gives back");
        assert_eq!(self.seen(&id).await, Some(before), "nothing has changed");
    }
}

async fn follows_the_model(records: Records, seed: u64) {
    let faults = Arc::new(Unlucky(Dice::new(seed)));
    let dice = Dice::new(seed ^ 0xabcd);
    let unlucky = records.clone().with_faults(faults);
    let mut script = Script {
        truth: records,
        records: unlucky,
        dice,
        jobs: BTreeMap::new(),
        suspects: BTreeSet::new(),
        faults_seen: 0,
    };
    let steps = count_of("RETARGETD_TEST_COMMANDS", 400);
    for _ in 0..steps {
        script.step().await;
    }
    assert!(script.faults_seen > steps as u64 / 30, "there were faults: {}", script.faults_seen);
    let waiting = script.jobs.values().filter(|job| job.state == JobState::Queued).count() as u64;
    assert_eq!(script.truth.queue_depth().await.expect("counts").jobs, waiting, "the books balance");
}

#[tokio::test(flavor = "multi_thread")]
async fn sqlite_follows_the_model_through_faults() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    follows_the_model(Records::open(&folder.path().join("state.db")).await.expect("opens"), 1).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn postgres_follows_the_model_through_faults() {
    let Some(server) = Postgres::start() else { return };
    follows_the_model(server.records().await, 2).await;
}
