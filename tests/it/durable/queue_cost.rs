//! What the queue costs a job beside its work, and that a long queue costs no more than a short one.
//!
//! `RETARGETD_TEST_QUEUED=50000` is the long form, which is held to its figures and prints them.

use std::{
    collections::BTreeSet,
    ops::AddAssign,
    sync::{Arc, Mutex},
    time::{Duration, Instant},
};

use jiff::Timestamp;
use retargetd::store::{Added, AddedBatch, AssetRecord, Claim, JobId, JobRecord, JobState, Lane, LeaseId, Records};

use super::{
    batch_records::{batch_of, jobs_of},
    records::{HOUR, asset, end, job},
    support::Postgres,
};
use crate::support::Extent;

/// What the queue may take from a job.
const MAX_PER_JOB: Duration = Duration::from_millis(2);
/// How much dearer a long queue may be than an empty one, and the first jobs of it than the last: what measurements differ by anyway.
const MAX_GROWTH: f64 = 1.5;
/// As many as a few processes have connections for.
const TAKERS: usize = 8;

/// What was spent on jobs.
#[derive(Clone, Copy, Debug, Default)]
struct Spent {
    adding: Duration,
    claiming: Duration,
    ending: Duration,
}

impl Spent {
    fn total(&self) -> Duration {
        self.adding + self.claiming + self.ending
    }

    fn each(&self, jobs: usize) -> String {
        let per_job = |spent: Duration| spent.as_secs_f64() * 1e3 / jobs as f64;
        let (all, adding) = (per_job(self.total()), per_job(self.adding));
        format!("{all:.2} ms (add {adding:.2}, claim {:.2}, end {:.2})", per_job(self.claiming), per_job(self.ending))
    }
}

impl AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.adding += other.adding;
        self.claiming += other.claiming;
        self.ending += other.ending;
    }
}

/// Takes a job and ends it at once, as a worker with nothing to do; `None` when none waits.
async fn work(records: &Records) -> Option<(JobId, Spent)> {
    let began = Instant::now();
    let job = loop {
        match records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("claims") {
            Claim::Job(job) | Claim::Suspect(job) => break job,
            Claim::Contended => {}
            Claim::NothingFor(_) | Claim::Nothing => return None,
        }
    };
    let (claiming, began) = (began.elapsed(), Instant::now());
    let from = (JobState::Running, job.lease.as_ref());
    let ended = records.finish_job(&job.id, from, &end(JobState::Succeeded, Vec::new())).await.expect("ends");
    assert!(ended.is_written(), "who has it ends it");
    Some((job.id, Spent { claiming, ending: began.elapsed(), ..Spent::default() }))
}

/// Jobs that are asked for, taken and ended, one after the other.
async fn one_by_one(records: &Records, file: &AssetRecord, count: usize) -> Spent {
    let mut spent = Spent::default();
    for _ in 0..count {
        let (new, began) = (job(file, 0), Instant::now());
        assert_eq!(records.add_job(&new).await.expect("writes"), Added::New, "its file is there");
        spent += Spent { adding: began.elapsed(), ..Spent::default() };
        let (id, worked) = work(records).await.expect("one waits");
        assert_eq!(id, new.id, "a single job goes before those of batches");
        spent += worked;
    }
    spent
}

/// Puts that many jobs into the queue, in batches.
async fn fill(records: &Records, file: &AssetRecord, count: usize) -> BTreeSet<JobId> {
    let mut queued = BTreeSet::new();
    while queued.len() < count {
        let batch = batch_of((count - queued.len()).min(1000) as u64);
        let jobs: Vec<JobRecord> = jobs_of(&batch, file);
        assert_eq!(records.add_batch(&batch, &jobs).await.expect("writes"), AddedBatch::New, "its file is there");
        queued.extend(jobs.into_iter().map(|job| job.id));
    }
    queued
}

/// Takes and ends that many jobs, by some who do so at the same time. Gives which, and how many in a second.
async fn drain(records: &Records, count: usize) -> (BTreeSet<JobId>, f64) {
    let (began, taken) = (Instant::now(), Arc::new(Mutex::new(BTreeSet::new())));
    let share = count.div_ceil(TAKERS);
    let takers = (0..TAKERS).map(|_| {
        let (records, taken) = (records.clone(), Arc::clone(&taken));
        tokio::spawn(async move {
            for _ in 0..share {
                let Some((id, _)) = work(&records).await else { return };
                assert!(taken.lock().expect("nobody panics").insert(id), "no job is given to two");
            }
        })
    });
    for taker in futures::future::join_all(takers).await {
        taker.expect("no panic");
    }
    let taken = std::mem::take(&mut *taken.lock().expect("nobody panics"));
    let rate = taken.len() as f64 / began.elapsed().as_secs_f64();
    (taken, rate)
}

async fn a_long_queue_costs_no_more_than_a_short_one(records: &Records, name: &str) {
    let extent = Extent::of("RETARGETD_TEST_QUEUED", 240);
    let (depth, rounds) = (extent.amount, if extent.is_measured { 1000 } else { 10 });
    let file = records.add_asset(&asset("ann", "aa")).await.expect("writes").0;
    one_by_one(records, &file, rounds / 10).await;
    let alone = one_by_one(records, &file, rounds).await;
    let mut queued = fill(records, &file, depth).await;
    let behind = one_by_one(records, &file, rounds).await;
    assert_eq!(records.queue_depth().await.expect("counts").batch_jobs, depth as u64, "all of it waits");

    let (first, first_rate) = drain(records, depth / 10).await;
    let (middle, _) = drain(records, depth - depth / 10 * 2).await;
    let (last, last_rate) = drain(records, depth).await;
    for id in first.iter().chain(&middle).chain(&last) {
        assert!(queued.remove(id), "{id} was asked for, and is given out once");
    }
    assert_eq!(queued.len(), 0, "none is lost");
    assert_eq!(records.queue_depth().await.expect("counts").batch_jobs, 0, "and none waits");

    let (alone_each, behind_each) = (alone.total() / rounds as u32, behind.total() / rounds as u32);
    let is_steady = first_rate < last_rate * MAX_GROWTH && last_rate < first_rate * MAX_GROWTH;
    extent.all_hold(&[
        (alone_each < MAX_PER_JOB, format!("{name}, nothing waits: {} per job", alone.each(rounds))),
        (
            behind_each.as_secs_f64() < alone_each.as_secs_f64() * MAX_GROWTH,
            format!("{name}, {depth} jobs wait: {} per job", behind.each(rounds)),
        ),
        (
            is_steady,
            format!(
                "{name}, {TAKERS} take and end them: {first_rate:.0} jobs a second of the first tenth, {last_rate:.0} of the last"
            ),
        ),
    ]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_queue_in_sqlite_costs_no_more_than_a_short_one() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let records = Records::open(&folder.path().join("state.db")).await.expect("opens");
    a_long_queue_costs_no_more_than_a_short_one(&records, "SQLite").await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_long_queue_in_postgres_costs_no_more_than_a_short_one() {
    let Some(server) = Postgres::start() else { return };
    a_long_queue_costs_no_more_than_a_short_one(&server.records().await, "Postgres").await;
}
