//! A database of the version before is brought up to date with all that it has, and a copy of a running one is whole.

use retargetd::store::{AfterCrash, ApiKeyRecord, Ended, JobState, Records};
use sqlx::{Connection as _, Executor as _};

use super::{
    records::{asset, claim, end, job, principal},
    support::Postgres,
};
use crate::service_process::ServiceProcess;

/// The layout of the version before this one, as its own migrations made it.
const BEFORE: [&str; 16] = [
    include_str!("../../../src/store/records/migrations/sqlite/0001_first.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0002_named_documents.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0003_queue.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0004_principals.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0005_events.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0006_job_lists.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0007_result_cache.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0008_webhooks.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0009_batches.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0010_trace_context.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0011_turns.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0012_bounds.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0013_scale.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0014_verdicts.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0015_time_used.sql"),
    include_str!("../../../src/store/records/migrations/sqlite/0016_unused_index.sql"),
];
/// The same of Postgres.
const BEFORE_ON_POSTGRES: [&str; 14] = [
    include_str!("../../../src/store/records/migrations/postgres/0001_first.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0002_principals.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0003_events.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0004_job_lists.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0005_result_cache.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0006_webhooks.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0007_batches.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0008_trace_context.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0009_turns_and_notices.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0010_bounds.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0011_scale.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0012_verdicts.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0013_time_used.sql"),
    include_str!("../../../src/store/records/migrations/postgres/0014_unused_index.sql"),
];

/// What the version before wrote: a job that failed, one that a worker has had for long, one that waits, and a rig.
macro_rules! written_before {
    () => {
        "CREATE TABLE request AS SELECT '{\"source\": {\"asset\": \"ast_000000000000aaaaaaaaaaaaaa\", \"sha256\": \"aa\", \"file_name\": \"a.bvh\"}, \
           \"target\": {\"asset\": \"ast_000000000000aaaaaaaaaaaaaa\", \"sha256\": \"aa\", \"file_name\": \"a.bvh\"}, \
           \"formats\": [], \"labels\": {}}' AS text; \
         INSERT INTO jobs (id, state, request, input_bytes, attempt, created_at, principal, priority, inputs_sha256, memory_bytes) \
         VALUES ('job_000000000000aaaaaaaaaaaaaa', 'failed', '{\"source\": 1}', 0, 1, 5, 'ann', 0, 'aa', 0); \
         INSERT INTO jobs (id, state, request, input_bytes, attempt, created_at, principal, priority, inputs_sha256, memory_bytes) \
         VALUES ('job_000000000000bbbbbbbbbbbbbb', 'queued', (SELECT text FROM request), 0, 0, 5, 'ann', 0, 'aa', 0), \
                ('job_000000000000cccccccccccccc', 'queued', (SELECT text FROM request), 0, 0, 6, 'ann', 0, 'aa', 0); \
         DROP TABLE request; \
         INSERT INTO api_keys (id, principal, sha256, scopes, created_at) \
         VALUES ('key_000000000000eeeeeeeeeeeeee', 'ann', 'aa', 'read', 5); \
         UPDATE jobs SET state = 'running', attempt = 1, started_at = 7, lease = 'lse_000000000000dddddddddddddd', lease_expires_at = 8 \
         WHERE id = 'job_000000000000bbbbbbbbbbbbbb'; \
         INSERT INTO named_documents (principal, kind, name, version, sha256, document, created_at) \
         VALUES ('ann', 'rig', 'mine', 1, 'aa', '{\"name\": \"mine\"}', 5);"
    };
}

/// All of it is there, the jobs run, and the layout takes what a new one takes.
async fn works_on(records: &Records) {
    let counts = records.record_counts(&principal("ann")).await.expect("counts");
    assert_eq!((counts.jobs, counts.documents), (3, 1), "what was there is counted: {counts:?}");
    assert!(counts.bytes > 1024, "with its bytes: {counts:?}");
    let lost = records.take_from_lost_workers(10, false, |_, _| AfterCrash::Requeue).await.expect("works");
    assert_eq!(lost.len(), 1, "what ran goes back to the queue");
    for _ in 0..2 {
        let job = claim(records).await.expect("what waits is taken");
        let held = (JobState::Running, job.lease.as_ref());
        let ended = records.finish_job(&job.id, held, &end(JobState::Succeeded, Vec::new())).await.expect("writes");
        assert_eq!(ended, Ended::Written { stopped: 0 }, "and ends");
    }
    let keys = records.api_keys().await.expect("lists");
    let is_good = |key: &ApiKeyRecord| key.note.is_empty() && key.revoked_at.is_none();
    assert!(keys.len() == 1 && keys.iter().all(is_good), "keys open as before: {keys:?}");
    let file = asset("bob", "aa");
    records.add_assets(std::slice::from_ref(&file)).await.expect("writes");
    records.add_job(&job(&file, 0)).await.expect("and it is written to as a new one");
    assert!(claim(records).await.is_some_and(|job| job.principal == principal("bob")), "who is new has a turn");
}

async fn connection(file: &std::path::Path) -> sqlx::SqliteConnection {
    let url = format!("sqlite://{}?mode=rwc", file.display());
    sqlx::SqliteConnection::connect(&url).await.expect("opens")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_database_of_the_version_before_is_brought_up_to_date() {
    let folder = tempfile::tempdir().expect("a folder");
    let (old, new) = (folder.path().join("old.db"), folder.path().join("new.db"));
    // What the migrator notes of each step is taken from a file that it has made itself.
    Records::open(&new).await.expect("opens").close().await;
    let mut database = connection(&old).await;
    for text in BEFORE {
        database.execute(sqlx::AssertSqlSafe(text)).await.expect("the layout of before");
    }
    let attach = format!("ATTACH '{}' AS new", new.display());
    database.execute(sqlx::AssertSqlSafe(attach)).await.expect("attaches");
    let notes = "CREATE TABLE _sqlx_migrations (version BIGINT PRIMARY KEY, description TEXT NOT NULL, \
                 installed_on TIMESTAMP NOT NULL DEFAULT CURRENT_TIMESTAMP, success BOOLEAN NOT NULL, \
                 checksum BLOB NOT NULL, execution_time BIGINT NOT NULL); \
                 INSERT INTO _sqlx_migrations SELECT version, description, installed_on, success, checksum, execution_time \
                 FROM new._sqlx_migrations WHERE version <= 16;";
    database.execute(notes).await.expect("as the version before left it");
    database.execute(written_before!()).await.expect("what it wrote");
    database.close().await.expect("closes");

    let records = Records::open(&old).await.expect("the version before is understood");
    works_on(&records).await;
    records.close().await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_postgres_of_the_version_before_is_brought_up_to_date() {
    let Some(server) = Postgres::start() else { return };
    // What the migrator notes of each step is taken from a layout that it has made itself.
    server.records().await.close().await;
    server
        .execute(
            "CREATE SCHEMA kept; CREATE TABLE kept.notes (LIKE _sqlx_migrations INCLUDING ALL); \
             INSERT INTO kept.notes SELECT * FROM _sqlx_migrations WHERE version <= 14; \
             DROP SCHEMA public CASCADE; CREATE SCHEMA public",
        )
        .await;
    for text in BEFORE_ON_POSTGRES {
        server.execute(text).await;
    }
    server.execute("ALTER TABLE kept.notes SET SCHEMA public; ALTER TABLE notes RENAME TO _sqlx_migrations").await;
    server.execute(written_before!()).await;

    let records = server.records().await;
    works_on(&records).await;
    records.close().await;
}

/// Postgres tells at every start that what is asked for "if it is not there" is there already; nobody who runs the service wants to know.
#[tokio::test(flavor = "multi_thread")]
async fn starts_on_a_postgres_that_is_up_to_date_log_nothing_of_its_notices() {
    let Some(server) = Postgres::start() else { return };
    server.answers().await;
    for start in ["the first", "a second"] {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log");
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["serve", "--listen", "127.0.0.1:0", "--log", "info", "--log-format", "json"]);
        command.args(["--database", &server.url()]).arg("--data").arg(folder.path().join("data"));
        let file = std::fs::File::create(&log).expect("a file");
        let service = ServiceProcess::listening_with_log(&mut command, file);
        assert_eq!(service.terminate(), Some(0), "{start} start ends well");
        let lines = std::fs::read_to_string(&log).expect("the log");
        assert!(lines.contains("retargetd"), "the service itself is heard: {lines}");
        assert!(!lines.contains("already exists, skipping"), "{start} start: {lines}");
    }
}

/// The lists above are all but the last of the migrations, and so are the numbers in the tests.
#[test]
fn the_version_before_is_the_one_before_the_last() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/store/records/migrations");
    for (name, before) in [("sqlite", BEFORE.len()), ("postgres", BEFORE_ON_POSTGRES.len())] {
        let files = std::fs::read_dir(folder.join(name)).expect("the folder").count();
        assert_eq!(before + 1, files, "migrations of {name}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_database_of_a_newer_version_is_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state.db");
    Records::open(&file).await.expect("opens").close().await;
    let mut database = connection(&file).await;
    let note = "INSERT INTO _sqlx_migrations SELECT 999, 'of tomorrow', installed_on, success, checksum, execution_time \
                FROM _sqlx_migrations WHERE version = 1";
    database.execute(note).await.expect("writes");
    database.close().await.expect("closes");
    let refused = Records::open(&file).await.expect_err("it may have what this version would harm");
    assert!(refused.to_string().contains("999"), "it says which change it does not know: {refused}");
}

/// As docs/operate.md says, with SQLite's own copy of a database that is in use.
#[tokio::test(flavor = "multi_thread")]
async fn a_copy_of_a_running_database_is_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    let (file, copy) = (folder.path().join("state.db"), folder.path().join("copy.db"));
    let records = Records::open(&file).await.expect("opens");
    let input = asset("ann", "aa");
    records.add_assets(std::slice::from_ref(&input)).await.expect("writes");
    let writer = {
        let (records, input) = (records.clone(), input.clone());
        tokio::spawn(async move {
            for _ in 0..200 {
                records.add_job(&job(&input, 0)).await.expect("writes");
            }
        })
    };
    tokio::time::sleep(std::time::Duration::from_millis(50)).await;
    let mut database = connection(&file).await;
    let statement = format!("VACUUM INTO '{}'", copy.display());
    database.execute(sqlx::AssertSqlSafe(statement)).await.expect("copies");
    writer.await.expect("went on");
    let restored = Records::open(&copy).await.expect("opens");
    let counts = restored.record_counts(&principal("ann")).await.expect("counts");
    let depth = restored.queue_depth().await.expect("counts");
    assert_eq!(counts.jobs, depth.jobs, "counts and rows are of one moment");
    assert!(
        restored
            .jobs(&principal("ann"), &Default::default(), None, 10)
            .await
            .expect("lists")
            .items
            .iter()
            .all(|job| job.state == JobState::Queued),
        "and can be read"
    );
}
