//! Callers take turns by the time that workers spend on their jobs, not by the number of jobs.

use std::time::Duration;

use jiff::Timestamp;
use retargetd::store::{Claim, JobRecord, JobState, Lane, LeaseId, Records, Wanted};

use super::records::{HOUR, added, claim, end};

/// Longer than is brief.
const LONG: Duration = Duration::from_millis(1100);

async fn finish(records: &Records, job: &JobRecord) {
    let held = (JobState::Running, job.lease.as_ref());
    records.finish_job(&job.id, held, &end(JobState::Succeeded, Vec::new())).await.expect("writes");
}

async fn next(records: &Records) -> JobRecord {
    claim(records).await.expect("one waits")
}

pub(super) async fn who_has_long_jobs_waits_for_who_has_short_ones(records: &Records) {
    for caller in ["ann", "bob"] {
        for _ in 0..5 {
            added(records, caller, 0).await;
        }
    }
    let (long, short) = (next(records).await, next(records).await);
    assert_eq!([&long, &short].map(|job| job.principal.as_str()), ["ann", "bob"], "nothing is known of them yet");
    finish(records, &short).await;
    tokio::time::sleep(LONG).await;
    finish(records, &long).await;
    for number in 0..3 {
        let job = next(records).await;
        assert_eq!(job.principal.as_str(), "bob", "until his have taken as long as hers: {number}");
        finish(records, &job).await;
    }
    let brief = Wanted { last: Lane::Single, is_brief: true };
    let brief = async || records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, brief).await.expect("claims");
    assert!(matches!(brief().await, Claim::Job(job) if job.principal.as_str() == "bob"), "his are brief");
    assert!(matches!(brief().await, Claim::NothingFor(_)), "hers are not");
    assert_eq!(next(records).await.principal.as_str(), "ann", "and go where any may");
}

pub(super) async fn time_that_was_not_asked_for_is_not_saved_up(records: &Records) {
    for _ in 0..5 {
        added(records, "ann", 0).await;
    }
    for _ in 0..3 {
        next(records).await;
    }
    for _ in 0..3 {
        added(records, "dan", 0).await;
    }
    let mut order = Vec::new();
    for _ in 0..3 {
        order.push(next(records).await.principal.as_str().to_owned());
    }
    assert_eq!(order, ["dan", "ann", "dan"], "who comes later is next, once");
}
