//! What only a database can do that several processes share: telling them of one another's changes, and finding the next job among many.

use retargetd::store::{GiveBack, JobState, Notice};

use super::{
    records::{added, claim, end},
    support::{PATIENCE, Postgres},
};

#[tokio::test(flavor = "multi_thread")]
async fn notices_reach_other_processes() {
    let Some(server) = Postgres::start() else { return };
    let (here, there) = (server.records().await, server.records().await);
    let mut listener = there.listen().await.expect("listens").expect("there are others");
    let mut hear = async || tokio::time::timeout(PATIENCE, listener.next()).await.expect("soon").expect("hears");
    let job = added(&here, "anonymous", 0).await;
    assert_eq!(hear().await, Notice::Job(job.id.clone(), JobState::Queued), "it waits");
    let taken = claim(&here).await.expect("a job");
    let lease = taken.lease.expect("a lease");
    assert!(here.give_back(&job.id, &lease, GiveBack::Drained).await.expect("writes"), "the holder");
    assert_eq!(
        hear().await,
        Notice::Job(job.id.clone(), JobState::Queued),
        "it waits again; that it ran concerns nobody"
    );
    let lease = claim(&here).await.expect("a job").lease.expect("a lease");
    assert!(here.request_cancel(&job.id).await.expect("writes"), "it runs");
    assert_eq!(hear().await, Notice::Job(job.id.clone(), JobState::Canceling), "its worker is told");
    let ended = end(JobState::Canceled, Vec::new());
    here.finish_job(&job.id, (JobState::Canceling, Some(&lease)), &ended).await.expect("writes");
    assert_eq!(hear().await, Notice::Job(job.id, JobState::Canceled), "and who waits for it");
}

/// With fifty thousand jobs in the queue, a claim looks at as many rows as with one, whether or not the database has counted them. Counted
/// by the database, so that no clock is needed. Another caller has none, and its turn comes first.
#[tokio::test(flavor = "multi_thread")]
async fn a_long_queue_does_not_slow_a_claim() {
    let Some(server) = Postgres::start() else { return };
    let records = server.records().await;
    added(&records, "aaron", 0).await;
    assert!(claim(&records).await.is_some(), "the other caller has had it");
    let first = added(&records, "anonymous", 0).await;
    server
        .execute(
            "ALTER TABLE jobs DISABLE TRIGGER USER; ALTER TABLE jobs SET (autovacuum_enabled = off); \
             UPDATE turns SET served = -1 WHERE principal = 'aaron'; \
             INSERT INTO jobs SELECT 'job_' || lpad(i::text, 26, '0'), state, request, input_bytes, attempt, retry_of, \
             created_at, started_at, finished_at, expires_at, warnings, failure, report, resolved_spec, principal, \
             priority, inputs_sha256, memory_bytes FROM jobs, generate_series(1, 50000) AS i WHERE state = 'queued'",
        )
        .await;
    records.close().await;
    for counted in ["", "ANALYZE jobs"] {
        server.execute(counted).await;
        let read = server.rows_read().await;
        let records = server.records().await;
        for _ in 0..10 {
            assert!(claim(&records).await.is_some_and(|job| job.id != first.id), "one of the many");
        }
        records.close().await;
        let per_claim = (server.rows_read().await - read) / 10;
        assert!(per_claim < 20, "a claim reads {per_claim} rows of the table of jobs after '{counted}'");
    }
}
