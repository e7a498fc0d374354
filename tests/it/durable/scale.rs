//! What callers ask of the records takes no longer where there are a million jobs of a thousand callers, and room that is freed is used again.
//!
//! `RETARGETD_TEST_RECORDS=1000000` is the long form, which is held to its figures and prints them.

use std::time::{Duration, Instant};

use jiff::Timestamp;
use retargetd::store::{
    AssetId, BatchId, Blobs, Claim, FinishedJob, JobFilter, JobId, JobKind, JobState, Lane, LeaseId, Principal,
    Records, Store,
};
use sqlx::Connection as _;

use super::{
    records::{HOUR, asset, end, job, principal},
    support::Postgres,
};
use crate::support::Extent;

/// What a query of a caller may take at p99.
const MOST: Duration = Duration::from_millis(50);
/// What one step of a sweep may.
const MAX_OF_SWEEP: Duration = Duration::from_millis(100);
const CALLERS: usize = 1000;

/// Rows as the service would have left them, without asking it for each: of a thousand callers, a fifth as many files as jobs, jobs in batches of
/// a hundred, a result and two events and a label for each, one in ten failed, some hundred that wait.
fn rows(jobs: usize, digits: impl Fn(&str) -> String, series: impl Fn(usize) -> String) -> Vec<String> {
    let caller = |of: &str| format!("'caller-' || CAST({of} % {CALLERS} AS TEXT)");
    let id = |prefix: &str, number: &str| format!("'{prefix}_' || {}", digits(number));
    let (assets, batches) = (jobs / 5, jobs / 200);
    let request = r#"{"source":{"asset":"ast_00000000000000000000000001","sha256":"aa","file_name":"walk.bvh"},"target":{"asset":"ast_00000000000000000000000001","sha256":"aa","file_name":"walk.bvh"},"source_rest":null,"target_rest":null,"config":null,"formats":[],"labels":{"shot":"010"},"preset":null,"rigs":[],"skip_cache":false,"webhook":null}"#;
    vec![
        format!(
            "INSERT INTO assets (id, principal, sha256, bytes, format, file_name, created_at, expires_at) SELECT {}, {}, \
             'a' || {}, 1000, 'bvh', 'walk.bvh', i, 4000000000000 FROM {} AS numbers",
            id("ast", "i"),
            caller("i"),
            digits("i"),
            series(assets)
        ),
        format!(
            "INSERT INTO batches (id, principal, created_at, on_error, items, labels) SELECT {}, {}, i, 'continue', 100, '{{}}' \
             FROM {} AS numbers",
            id("bat", "i"),
            caller("i"),
            series(batches)
        ),
        format!(
            "INSERT INTO jobs (id, state, request, input_bytes, attempt, created_at, started_at, finished_at, expires_at, principal, \
             priority, inputs_sha256, memory_bytes, kind, cache_key, batch_id, batch_item, report) \
             SELECT {}, CASE WHEN i % 10 = 0 THEN 'failed' ELSE 'succeeded' END, '{request}', 1000, 1, i, i, i, 3000000000000 + i, {}, \
             0, 'aa', 1000, 'retarget', 'k' || {}, CASE WHEN i % 2 = 0 THEN {} ELSE NULL END, i / {batches}, '{{}}' FROM {} AS numbers",
            id("job", "i"),
            caller("i"),
            digits("i"),
            id("bat", &format!("((i / 2) % {batches} + 1)")),
            series(jobs)
        ),
        format!(
            "INSERT INTO results (id, job_id, position, format, file_name, sha256, bytes, created_at, expires_at) SELECT {}, {}, 0, 'glb', \
             'walk.glb', 'r' || {}, 5000, i, 3000000000000 + i FROM {} AS numbers",
            id("res", "i"),
            id("job", "i"),
            digits("i"),
            series(jobs)
        ),
        format!(
            "INSERT INTO job_labels (job_id, principal, name, value) SELECT {}, {}, 'shot', CAST(i % 50 AS TEXT) FROM {} AS numbers",
            id("job", "i"),
            caller("i"),
            series(jobs)
        ),
        format!(
            "INSERT INTO events (principal, number, job_id, state, created_at) SELECT {}, i, {}, 'succeeded', i FROM {} AS numbers",
            caller("i"),
            id("job", "i"),
            series(jobs)
        ),
        format!(
            "INSERT INTO event_heads (principal, last) SELECT {}, {jobs} FROM {} AS numbers",
            caller("i"),
            series(CALLERS)
        ),
        format!(
            "INSERT INTO turns (principal, served, seen_at) SELECT {}, 1, 1 FROM {} AS numbers",
            caller("i"),
            series(CALLERS)
        ),
        format!(
            "INSERT INTO record_counts (principal, jobs, bytes) SELECT {}, {}, 0 FROM {} AS numbers",
            caller("i"),
            jobs / CALLERS,
            series(CALLERS)
        ),
    ]
}

async fn fill_sqlite(file: &std::path::Path, jobs: usize) {
    let url = format!("sqlite://{}", file.display());
    let mut database = sqlx::SqliteConnection::connect(&url).await.expect("opens");
    let triggers = "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'";
    let triggers: Vec<(String, String)> = sqlx::query_as(triggers).fetch_all(&mut database).await.expect("reads");
    let mut run = async |text: String| {
        sqlx::raw_sql(sqlx::AssertSqlSafe(text)).execute(&mut database).await.expect("the statement works");
    };
    run("PRAGMA synchronous = OFF; PRAGMA cache_size = -200000; PRAGMA foreign_keys = OFF".to_owned()).await;
    for (name, _) in &triggers {
        run(format!("DROP TRIGGER {name}")).await;
    }
    let digits = |number: &str| format!("printf('%026d', {number})");
    let series = |count: usize| {
        format!(
            "(WITH RECURSIVE numbers (i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM numbers WHERE i < {count}) SELECT i FROM numbers)"
        )
    };
    for text in rows(jobs, digits, series) {
        run(text).await;
    }
    for (_, text) in triggers {
        run(text).await;
    }
    run("PRAGMA wal_checkpoint(TRUNCATE)".to_owned()).await;
    database.close().await.expect("closes");
}

async fn fill_postgres(server: &Postgres, jobs: usize) {
    let mut database = sqlx::PgConnection::connect(&server.url()).await.expect("connects");
    let mut run = async |text: String| {
        sqlx::raw_sql(sqlx::AssertSqlSafe(text)).execute(&mut database).await.expect("the statement works");
    };
    run("SET session_replication_role = replica".to_owned()).await;
    let digits = |number: &str| format!("lpad(CAST({number} AS TEXT), 26, '0')");
    for text in rows(jobs, digits, |count| format!("(SELECT i FROM generate_series(1, {count}) AS i)")) {
        run(text).await;
    }
    run("VACUUM ANALYZE".to_owned()).await;
}

/// What was measured of each question.
struct Times {
    of: Vec<(&'static str, Duration, Duration)>,
    extent: usize,
}

impl Times {
    /// Asks again and again, and keeps the median and p99.
    async fn ask(&mut self, what: &'static str, mut ask: impl AsyncFnMut(usize)) {
        let mut times = Vec::new();
        for number in 0..self.extent {
            let began = Instant::now();
            ask(number).await;
            times.push(began.elapsed());
        }
        times.sort_unstable();
        self.of.push((what, times[times.len() / 2], times[times.len() * 99 / 100]));
    }
}

async fn ask_everything(records: &Records, jobs: usize, extent: usize) -> Times {
    let mut times = Times { of: Vec::new(), extent };
    let caller = |number: usize| -> Principal { principal(&format!("caller-{}", number * 7 % CALLERS)) };
    let some = |number: usize| number * 7919 % jobs + 1;
    let job_id = |number: usize| JobId::parse(&format!("job_{:026}", some(number))).expect("an id");
    let filter = JobFilter::default;
    times
        .ask("list of jobs", async |n| {
            assert!(
                !records.jobs(&caller(n), &filter(), None, 100).await.expect("lists").items.is_empty(),
                "there are some"
            );
        })
        .await;
    times
        .ask("list of jobs, far behind", async |n| {
            records.jobs(&caller(n), &filter(), Some(&job_id(n)), 100).await.expect("lists");
        })
        .await;
    times
        .ask("list of failed jobs", async |n| {
            let filter = JobFilter { state: Some(JobState::Failed), ..filter() };
            records.jobs(&caller(n), &filter, None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("list of jobs of a kind that has none", async |n| {
            let filter = JobFilter { kind: Some(JobKind::Pose), ..filter() };
            records.jobs(&caller(n), &filter, None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("list of jobs with a label", async |n| {
            let filter = JobFilter { label: Some(("shot".to_owned(), (n % 60).to_string())), ..filter() };
            records.jobs(&caller(n), &filter, None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("list of jobs since lately", async |n| {
            let filter =
                JobFilter { since: Some(Timestamp::from_second(3_000_000_000).expect("in the year 2065")), ..filter() };
            records.jobs(&caller(n), &filter, None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("job, its results and its report", async |n| {
            records.job(&job_id(n)).await.expect("reads").expect("is there");
            records.job_results(&job_id(n)).await.expect("reads");
            records.job_report(&caller(n), &job_id(n)).await.expect("reads");
        })
        .await;
    times
        .ask("list of files", async |n| {
            records.assets(&caller(n), None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("file", async |n| {
            let id = AssetId::parse(&format!("ast_{:026}", some(n) / 5)).expect("an id");
            records.asset(&caller(n), &id).await.expect("reads");
        })
        .await;
    times
        .ask("usage", async |n| {
            records.holdings(&caller(n)).await.expect("counts");
        })
        .await;
    times
        .ask("list of batches with their progress", async |n| {
            let page = records.batches(&caller(n), None, 100).await.expect("lists");
            records
                .batch_progress(&page.items.iter().map(|batch| &batch.id).collect::<Vec<_>>())
                .await
                .expect("counts");
        })
        .await;
    times
        .ask("items of a batch", async |n| {
            let id = BatchId::parse(&format!("bat_{:026}", some(n) / 200)).expect("an id");
            records.batch_jobs(&id, (Some(JobState::Failed), None), None, 100).await.expect("lists");
        })
        .await;
    times
        .ask("events", async |n| {
            records.event_reach(&caller(n)).await.expect("reads");
            records.events_after(&caller(n), some(n) as u64, 100).await.expect("lists");
        })
        .await;
    times
        .ask("events of a job", async |n| {
            records.job_events_after(&job_id(n), 0, 100).await.expect("lists");
        })
        .await;
    times
        .ask("cached results", async |n| {
            records
                .cached_results(&caller(n), &format!("k{:026}", some(n)), Timestamp::UNIX_EPOCH)
                .await
                .expect("looks");
        })
        .await;
    times
        .ask("room in queue, in records, of a caller", async |n| {
            records.queue_depth().await.expect("counts");
            records.oldest_queued().await.expect("looks");
            records.unfinished_jobs(&caller(n)).await.expect("counts");
            records.record_counts(&caller(n)).await.expect("counts");
            records.all_record_counts().await.expect("counts");
        })
        .await;
    times
        .ask("upload, job, claim", async |n| {
            let mut file = asset("caller-1", &format!("{n:064}"));
            file.principal = caller(n);
            records.add_assets(std::slice::from_ref(&file)).await.expect("writes");
            records.add_job(&job(&file, 0)).await.expect("writes");
            let claim =
                records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("claims");
            assert!(matches!(claim, Claim::Job(_)), "there is one");
        })
        .await;
    times
}

/// Sweeps of a hundred jobs each, with what they gave and what happened to them.
async fn sweep(records: &Records, times: &mut Times) {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::new(records.clone(), Blobs::local(folder.path()).expect("a folder"));
    let mut until = 0;
    times
        .ask("events of 100 jobs are removed", async |_| {
            until += 100;
            records.remove_events_until(Timestamp::from_millisecond(until).expect("a time")).await.expect("removes");
        })
        .await;
    let mut until = 3_000_000_000_000;
    times
        .ask("100 jobs are removed, with their files", async |_| {
            until += 100;
            store.sweep(Timestamp::from_millisecond(until).expect("a time")).await.expect("sweeps");
        })
        .await;
}

async fn measure(what: &str, records: &Records) {
    let extent = Extent::of("RETARGETD_TEST_RECORDS", 5000);
    let (asked, swept) = if extent.is_measured { (500, 40) } else { (5, 2) };
    let mut times = ask_everything(records, extent.amount, asked).await;
    let queries = times.of.len();
    times.extent = swept;
    sweep(records, &mut times).await;
    let began = Instant::now();
    records.stored_bytes().await.expect("counts");
    let milliseconds = |time: &Duration| time.as_secs_f64() * 1e3;
    let mut figures = vec![(
        true,
        format!("{what}: the sweeper's count of what is stored: {:.0} ms", milliseconds(&began.elapsed())),
    )];
    for (number, (name, median, p99)) in times.of.iter().enumerate() {
        let most = if number < queries { MOST } else { MAX_OF_SWEEP };
        let (median, in_all) = (milliseconds(median), milliseconds(p99));
        figures.push((*p99 <= most, format!("{what}: {name}: median {median:.2} ms, p99 {in_all:.2} ms")));
    }
    extent.all_hold(&figures);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_million_jobs_slow_nobody_down_on_sqlite() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state.db");
    Records::open(&file).await.expect("opens").close().await;
    fill_sqlite(&file, Extent::of("RETARGETD_TEST_RECORDS", 5000).amount).await;
    let records = Records::open(&file).await.expect("opens");
    measure("SQLite", &records).await;
    records.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_million_jobs_slow_nobody_down_on_postgres() {
    let Some(server) = Postgres::start() else { return };
    server.records().await.close().await;
    fill_postgres(&server, Extent::of("RETARGETD_TEST_RECORDS", 5000).amount).await;
    let records = server.records().await;
    measure("Postgres", &records).await;
    records.close().await;
}

/// Jobs that come and go for years take as much room as they do at once.
#[tokio::test(flavor = "multi_thread")]
async fn a_database_that_is_swept_does_not_grow() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state.db");
    let records = Records::open(&file).await.expect("opens");
    let store = Store::new(records.clone(), Blobs::local(folder.path()).expect("a folder"));
    let later = Timestamp::from_second(4_000_000_000).expect("in the year 2096");
    let input = asset("ann", "aa");
    let mut sizes = Vec::new();
    for _ in 0..4 {
        records.add_assets(std::slice::from_ref(&input)).await.expect("writes");
        for _ in 0..300 {
            records.add_job(&job(&input, 0)).await.expect("writes");
            let Claim::Job(taken) =
                records.claim_job(&LeaseId::new(), HOUR, Timestamp::UNIX_EPOCH, Lane::Batch).await.expect("claims")
            else {
                panic!("there is one");
            };
            let end = FinishedJob { report: Some("x".repeat(8000)), ..end(JobState::Succeeded, Vec::new()) };
            records.finish_job(&taken.id, (JobState::Running, taken.lease.as_ref()), &end).await.expect("ends");
        }
        let mut database =
            sqlx::SqliteConnection::connect(&format!("sqlite://{}", file.display())).await.expect("opens");
        let mut bytes = async || -> i64 {
            let pages = "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size";
            sqlx::query_scalar(pages).fetch_one(&mut database).await.expect("counts")
        };
        let full = bytes().await;
        store.sweep(later).await.expect("sweeps");
        records.remove_events_until(later).await.expect("removes");
        store.sweep(later).await.expect("gives the rest back");
        sizes.push((full, bytes().await));
    }
    assert!(sizes.iter().all(|(full, swept)| swept * 4 < *full), "room is given back to the disk: {sizes:?}");
    assert!(sizes[3].0 < sizes[0].0 * 5 / 4, "and the next that come take no more: {sizes:?}");
}
