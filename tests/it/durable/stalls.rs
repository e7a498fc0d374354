//! What one caller waits for does not stop what keeps the service going: leases, probes, and files of others.

use std::time::Duration;

use futures::future::join_all;
use retargetd::store::{Blobs, Held, JobFilter, JobState, Records, Store, StoredProgress};
use sqlx::{Connection as _, Executor as _};

use super::{
    records::{HOUR, added, claim, principal},
    support::Postgres,
};

/// What does not wait is done by then, also on a busy machine; what waits for lists takes five seconds.
const SOON: Duration = Duration::from_secs(3);
const CONNECTIONS: u32 = 4;

async fn soon<T>(what: &str, future: impl Future<Output = T>) -> T {
    tokio::time::timeout(SOON, future).await.unwrap_or_else(|_| panic!("{what} waits"))
}

async fn connect(server: &Postgres) -> Records {
    server.answers().await;
    Records::connect(&server.url(), CONNECTIONS).await.expect("the database opens")
}

#[tokio::test(flavor = "multi_thread")]
async fn lists_that_take_long_stop_neither_leases_nor_probes() {
    let Some(server) = Postgres::start() else { return };
    let records = connect(&server).await;
    let waiting = added(&records, "ann", 0).await;
    added(&records, "ann", 0).await;
    let job = claim(&records).await.expect("a job");
    let mut other = sqlx::PgConnection::connect(&server.url()).await.expect("connects");
    other.execute("BEGIN; LOCK TABLE job_labels IN ACCESS EXCLUSIVE MODE").await.expect("locks");
    let lists: Vec<_> = (0..40)
        .map(|_| {
            let records = records.clone();
            tokio::spawn(async move {
                let filter = JobFilter { label: Some(("shot".into(), "1".into())), ..JobFilter::default() };
                records.jobs(&principal("mallory"), &filter, None, 9).await.map(|_| ())
            })
        })
        .collect();
    tokio::time::sleep(Duration::from_millis(300)).await;

    soon("a probe", records.check()).await.expect("the database answers");
    let held = Held {
        id: job.id.clone(),
        lease: job.lease.clone().expect("a lease"),
        progress: StoredProgress { phase: "read".to_owned(), done: 0, total: 1 },
    };
    let states = soon("a lease", records.extend_leases(&[held], HOUR)).await.expect("extends");
    assert_eq!(states, [Some(JobState::Running)], "and the worker keeps its job");
    soon("a claim", claim(&records)).await.expect("the next job");
    assert!(soon("a job", records.job(&waiting.id)).await.expect("reads").is_some(), "others are answered");
    let ends = tokio::time::timeout(Duration::from_secs(30), lists.into_iter().next().expect("one")).await;
    assert!(ends.expect("a list that takes too long ends").expect("no panic").is_err(), "with an error");
    other.execute("ROLLBACK").await.expect("unlocks");
    records.close().await;
}

/// More hold files than there are connections for it, and one file is about to be removed while somebody holds it.
#[tokio::test(flavor = "multi_thread")]
async fn files_that_are_held_for_long_stop_only_who_wants_them() {
    let Some(server) = Postgres::start() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let records = connect(&server).await;
    let store = std::sync::Arc::new(Store::new(records.clone(), Blobs::local(folder.path()).expect("a folder")));
    let digest = |number: usize| format!("{number:064x}").chars().rev().collect::<String>();

    let held = store.hold_blobs(&[&digest(0)]).await.expect("holds");
    let removal = {
        let (store, digests) = (std::sync::Arc::clone(&store), vec![digest(0)]);
        tokio::spawn(async move { store.remove_unnamed(&digests).await })
    };
    tokio::time::sleep(Duration::from_millis(300)).await;
    let mut waiting = 0;
    for number in 1..=50 {
        let digest = digest(number);
        waiting +=
            usize::from(tokio::time::timeout(Duration::from_millis(500), store.hold_blobs(&[&digest])).await.is_err());
    }
    assert!(waiting <= 5, "only those of the same gate wait: {waiting} of 50");
    assert!(!removal.is_finished(), "what is held is not removed");
    drop(held);
    soon("the removal", removal).await.expect("no panic").expect("removes");

    let holders = (0..CONNECTIONS as usize * 3).map(|number| {
        let (store, digest) = (std::sync::Arc::clone(&store), digest(number + 100));
        tokio::spawn(async move {
            let held = store.hold_blobs(&[&digest]).await;
            tokio::time::sleep(Duration::from_secs(1)).await;
            held.map(|_| ())
        })
    });
    let holders: Vec<_> = holders.collect();
    tokio::time::sleep(Duration::from_millis(200)).await;
    added(&records, "ann", 0).await;
    soon("a claim", claim(&records)).await.expect("claims beside those who hold files");
    for holder in join_all(holders).await {
        holder.expect("no panic").expect("whoever waits for a connection has one in the end");
    }
    records.close().await;
}
