//! What the records of batches promise, whichever database keeps them; part of the suite of `records`.

use std::time::Duration;

use jiff::Timestamp;
use retargetd::store::{
    AddedAgain, AddedBatch, AssetRecord, BatchId, BatchPlace, BatchRecord, Claim, Ended, FinishedJob, Idempotency,
    InputRole, JobFailure, JobId, JobRecord, JobState, Lane, LeaseId, OnError, Records,
};

use super::records::{HOUR, asset, end, job, principal};

fn batch(items: u64, on_error: OnError) -> BatchRecord {
    BatchRecord {
        id: BatchId::new(),
        principal: principal("ann"),
        created_at: Timestamp::UNIX_EPOCH,
        on_error,
        items,
        labels: [("reel".to_owned(), "7 \u{0} ü".to_owned())].into(),
        idempotency: Some(Idempotency { key: BatchId::new().to_string(), asked_sha256: "aa".to_owned() }),
    }
}

/// A batch of that many items that goes on whatever fails.
pub(super) fn batch_of(items: u64) -> BatchRecord {
    batch(items, OnError::Continue)
}

pub(super) fn jobs_of(batch: &BatchRecord, file: &AssetRecord) -> Vec<JobRecord> {
    let place = |item| Some(BatchPlace { batch: batch.id.clone(), item });
    (0..batch.items).map(|item| JobRecord { batch: place(item), ..job(file, 0) }).collect()
}

fn failure(code: &str) -> JobFailure {
    JobFailure {
        code: code.to_owned(),
        detail: String::new(),
        part: String::new(),
        place: String::new(),
        hint: String::new(),
        errors: Vec::new(),
    }
}

fn failed() -> FinishedJob {
    let (failure, stops_batch) = (Some(failure("no_animation")), Some(failure("batch_stopped")));
    FinishedJob { failure, stops_batch, ..end(JobState::Failed, Vec::new()) }
}

async fn file(records: &Records) -> AssetRecord {
    records.add_asset(&asset("ann", "aa")).await.expect("writes").0
}

pub(super) async fn added(records: &Records, items: u64, on_error: OnError) -> (BatchRecord, Vec<JobRecord>) {
    let batch = batch(items, on_error);
    let jobs = jobs_of(&batch, &file(records).await);
    assert_eq!(records.add_batch(&batch, &jobs).await.expect("writes"), AddedBatch::New, "its file is there");
    (batch, jobs)
}

async fn claim(records: &Records, last: Lane) -> Option<JobRecord> {
    match records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, last).await.expect("claims") {
        Claim::Job(job) | Claim::Suspect(job) => Some(*job),
        _ => None,
    }
}

async fn finish(records: &Records, job: &JobRecord, finished: &FinishedJob) -> Ended {
    records.finish_job(&job.id, (job.state, job.lease.as_ref()), finished).await.expect("ends")
}

async fn states(records: &Records, batch: &BatchRecord) -> Vec<(JobState, u64)> {
    let progress = records.batch_progress(&[&batch.id]).await.expect("counts").remove(&batch.id).unwrap_or_default();
    progress.jobs.into_iter().collect()
}

pub(super) async fn a_batch_is_written_with_all_its_jobs_or_not_at_all(records: &Records) {
    let (batch, jobs) = added(records, 250, OnError::Stop).await;
    let read = records.batch(&batch.principal, &batch.id).await.expect("reads").expect("is there");
    assert_eq!(read, batch, "every field");
    assert!(records.batch(&principal("bob"), &batch.id).await.expect("reads").is_none(), "not his");
    assert_eq!(states(records, &batch).await, [(JobState::Queued, 250)], "all of them wait");
    let page = records.batch_jobs(&batch.id, (None, None), Some(199), 100).await.expect("lists");
    assert!(page.items == jobs[200..] && !page.has_more, "every field of every job, in the order of the items");
    let depth = records.queue_depth().await.expect("counts");
    assert_eq!((depth.jobs, depth.batch_jobs), (0, 250), "counted by themselves");

    let again = records.add_batch(&BatchRecord { id: BatchId::new(), ..batch.clone() }, &jobs[..1]).await;
    assert_eq!(again.expect("answers"), AddedBatch::Before(Box::new(batch.clone())), "the same key is the same batch");
    let other = self::batch(2, OnError::Continue);
    let mut with_unknown = jobs_of(&other, &file(records).await);
    with_unknown[1].request.inputs.get_mut(&InputRole::Target).expect("a file").asset = asset("ann", "zz").id;
    let refused = records.add_batch(&other, &with_unknown).await.expect("answers");
    assert_eq!(refused, AddedBatch::FileMissing, "without one file there is no batch");
    assert!(records.batch(&other.principal, &other.id).await.expect("reads").is_none(), "not even half of one");
    with_unknown[1].state = JobState::Failed;
    (with_unknown[1].finished_at, with_unknown[1].failure) =
        (Some(Timestamp::UNIX_EPOCH), Some(failure("unknown_asset")));
    assert_eq!(
        records.add_batch(&other, &with_unknown).await.expect("writes"),
        AddedBatch::New,
        "unless it has failed"
    );
    assert_eq!(states(records, &other).await, [(JobState::Queued, 1), (JobState::Failed, 1)], "and the other waits");
    let listed = records.batches(&batch.principal, None, 1).await.expect("lists");
    assert!(listed.items == [other] && listed.has_more, "newest first");
}

pub(super) async fn jobs_of_batches_wait_behind_single_ones_and_callers_take_turns(records: &Records) {
    let (_, batched) = added(records, 3, OnError::Continue).await;
    let single = job(&file(records).await, -100);
    records.add_job(&single).await.expect("writes");
    let his = records.add_asset(&asset("bob", "aa")).await.expect("writes").0;
    let his = job(&his, 0);
    records.add_job(&his).await.expect("writes");
    let ids = [&batched[0].id, &batched[1].id, &single.id];
    let places = records.queue_positions(&single.principal, &ids, 2).await.expect("counts");
    assert_eq!(places[&batched[0].id], 2, "behind the single one");
    assert_eq!((places[&single.id], places[&batched[1].id]), (1, 3), "counted no further than asked for");
    for job in [&batched[0], &batched[1], &single] {
        let place = records.queue_position(job, 2).await.expect("counts");
        assert_eq!(place, places[&job.id], "one by itself has the place that it has among others");
    }
    let mut order: Vec<JobId> = Vec::new();
    while let Some(job) = claim(records, Lane::Batch).await {
        order.push(job.id);
    }
    let expected = [&single, &his, &batched[0], &batched[1], &batched[2]].map(|job| job.id.clone());
    assert_eq!(order, expected, "whatever its priority, the single one goes first; then the other caller");
    let (_, more) = added(records, 2, OnError::Continue).await;
    assert!(claim(records, Lane::Single).await.is_none(), "who takes no jobs of batches gets none");
    let look = records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Single).await;
    assert_eq!(look.expect("looks"), Claim::Nothing, "and need not look again soon");
    assert_eq!(claim(records, Lane::Batch).await.map(|job| job.id).as_ref(), Some(&more[0].id), "others do");
}

pub(super) async fn a_failure_stops_what_waits_in_its_transaction(records: &Records) {
    let (batch, _) = added(records, 4, OnError::Stop).await;
    let (one, other) =
        (claim(records, Lane::Batch).await.expect("a job"), claim(records, Lane::Batch).await.expect("a job"));
    assert_eq!(finish(records, &one, &failed()).await, Ended::Written { stopped: 2 }, "the two that wait");
    assert!(claim(records, Lane::Batch).await.is_none(), "nothing starts any more");
    assert_eq!(
        finish(records, &other, &end(JobState::Succeeded, Vec::new())).await,
        Ended::Written { stopped: 0 },
        "goes on"
    );
    let expected = [(JobState::Succeeded, 1), (JobState::Failed, 1), (JobState::Canceled, 2)];
    assert_eq!(states(records, &batch).await, expected, "each has its end");
    let again = records.failed_batch_jobs(&batch.id, false).await.expect("lists");
    let codes: Vec<&str> = again.iter().filter_map(|job| Some(job.failure.as_ref()?.code.as_str())).collect();
    assert_eq!(codes, ["no_animation", "batch_stopped", "batch_stopped"], "what can be asked for again");

    let (batch, _) = added(records, 2, OnError::Continue).await;
    let one = claim(records, Lane::Batch).await.expect("a job");
    assert_eq!(finish(records, &one, &failed()).await, Ended::Written { stopped: 0 }, "where it is not to stop");
    assert_eq!(states(records, &batch).await, [(JobState::Queued, 1), (JobState::Failed, 1)], "the other waits");
}

pub(super) async fn an_item_that_is_asked_for_again_counts_once(records: &Records) {
    let (batch, _) = added(records, 3, OnError::Continue).await;
    let one = claim(records, Lane::Batch).await.expect("a job");
    finish(records, &one, &failed()).await;
    let newer = |older: &JobRecord| JobRecord {
        retry_of: Some(older.id.clone()),
        batch: older.batch.clone(),
        ..job(&AssetRecord { id: older.request.inputs[&InputRole::Source].asset.clone(), ..asset("ann", "aa") }, 0)
    };
    let again = newer(&one);
    let add = async |jobs: &[JobRecord]| records.add_again(&batch.principal, jobs).await.expect("answers");
    assert_eq!(add(std::slice::from_ref(&again)).await, AddedAgain::New, "in its place");
    assert_eq!(add(&[newer(&one)]).await, AddedAgain::Outrun, "once");
    let mut without_file = newer(&again);
    without_file.request.inputs.get_mut(&InputRole::Source).expect("a file").asset = asset("ann", "zz").id;
    assert_eq!(add(&[without_file]).await, AddedAgain::FileMissing, "without its file there is no job");
    let progress = records.batch_progress(&[&batch.id]).await.expect("counts").remove(&batch.id).expect("is there");
    assert_eq!(progress.jobs.into_iter().collect::<Vec<_>>(), [(JobState::Queued, 3)], "the newest of each");
    assert_eq!(progress.retried, 1, "and how often");
    let first = records.batch_jobs(&batch.id, (None, None), None, 1).await.expect("lists").items;
    assert_eq!(first[0].id, again.id, "is what is listed");
}

pub(super) async fn a_batch_is_stopped_whatever_its_jobs_do(records: &Records) {
    let (batch, _) = added(records, 60, OnError::Continue).await;
    // Ten take jobs and end them while somebody else stops the batch.
    let workers = (0..10).map(|_| {
        let records = records.clone();
        tokio::spawn(async move {
            while let Some(job) = claim(&records, Lane::Batch).await {
                let done = end(JobState::Succeeded, Vec::new());
                if !records
                    .finish_job(&job.id, (JobState::Running, job.lease.as_ref()), &done)
                    .await
                    .expect("ends")
                    .is_written()
                {
                    let canceled = end(JobState::Canceled, Vec::new());
                    let from = (JobState::Canceling, job.lease.as_ref());
                    assert!(
                        records.finish_job(&job.id, from, &canceled).await.expect("ends").is_written(),
                        "told to stop"
                    );
                }
            }
        })
    });
    let workers: Vec<_> = workers.collect();
    let mut ended = 0;
    loop {
        let stopped = records.stop_batch(&batch.id, &end(JobState::Canceled, Vec::new())).await.expect("stops");
        ended += stopped.ended;
        if !stopped.has_more {
            break;
        }
        tokio::time::sleep(Duration::from_millis(1)).await;
    }
    for worker in workers {
        worker.await.expect("no panic");
    }
    let states = states(records, &batch).await;
    assert_eq!(states.iter().map(|(_, count)| count).sum::<u64>(), 60, "each has one end: {states:?}");
    assert!(states.iter().all(|(state, _)| state.is_final()), "nothing is left: {states:?}, {ended} while they waited");
}

pub(super) async fn a_batch_goes_with_the_last_of_its_jobs(records: &Records) {
    let (batch, jobs) = added(records, 2, OnError::Continue).await;
    let canceled = end(JobState::Canceled, Vec::new());
    for job in &jobs {
        assert!(finish(records, job, &canceled).await.is_written(), "it waits");
    }
    assert!(records.remove_job(&jobs[0].id).await.expect("removes").is_some(), "one");
    assert_eq!(states(records, &batch).await, [(JobState::Canceled, 1)], "is counted no more");
    assert!(records.remove_job(&jobs[1].id).await.expect("removes").is_some(), "the other");
    assert!(records.batch_progress(&[&batch.id]).await.expect("counts").is_empty(), "nothing is left of it");
}
