//! No statement looks at all rows of a table that grows with the number of jobs, files or callers.
//!
//! Every statement that the promises of the records run is listened to, and the database is asked by what it finds its rows.

use std::{
    collections::BTreeSet,
    fmt::Debug,
    sync::{Arc, Mutex},
};

use jiff::Timestamp;
use retargetd::store::{
    Blobs, DocumentKind, JobFilter, JobId, JobKind, JobState, JobVerdict, OnError, Records, Store, WebhookId,
};
use sqlx::{Connection as _, Row as _};
use tracing::field::{Field, Visit};
use tracing_subscriber::{Layer, layer::SubscriberExt as _};

use super::{
    batch_records, outbox, record_bounds, records,
    records::{asset, end, principal},
    support::Postgres,
};

/// Those with a row or more for each job, file or batch.
const LARGE: [&str; 9] =
    ["jobs", "assets", "results", "events", "deliveries", "job_labels", "job_inputs", "batches", "named_documents"];
/// Indices that may be read from one end to the other: of what waits or runs, which is bounded, or as the sweeper's count of what is stored,
/// for which nobody waits.
const MAY_BE_WALKED: [&str; 6] =
    ["jobs_by_expiry", "jobs_waiting", "jobs_leased", "assets_by_blob", "results_by_blob", "deliveries_due"];

/// What few rows have, and the index that finds them by it.
const FOUND_BY: [(&str, &str); 2] =
    [("cache_key = $", "jobs_by_cache_key"), ("idempotency_key = $", "_by_idempotency_key")];

/// Keeps the text of every statement.
#[derive(Clone, Default)]
struct Statements(Arc<Mutex<BTreeSet<String>>>);

impl<S: tracing::Subscriber> Layer<S> for Statements {
    fn on_event(&self, event: &tracing::Event<'_>, _: tracing_subscriber::layer::Context<'_, S>) {
        #[derive(Default)]
        struct Text(String);
        impl Visit for Text {
            fn record_str(&mut self, field: &Field, value: &str) {
                // The whole text stands beside the summary only where it is longer.
                if field.name() == "db.statement" && !value.trim().is_empty()
                    || field.name() == "summary" && self.0.is_empty()
                {
                    self.0 = value.trim().to_owned();
                }
            }
            fn record_debug(&mut self, _: &Field, _: &dyn Debug) {}
        }
        if event.metadata().target() == "sqlx::query" {
            let mut text = Text::default();
            event.record(&mut text);
            self.0.lock().expect("nobody panics").insert(text.0);
        }
    }
}

/// What the promises do not ask for: lists with every filter, counts, and sweeps.
async fn look_at_everything(records: Records) {
    let ann = principal("ann");
    let files = [asset("ann", "aa"), asset("ann", "bb")];
    records.add_assets(&files).await.expect("writes");
    let job = records::job(&files[0], 0);
    records.add_job(&job).await.expect("writes");
    let filters = [None, Some(JobState::Failed)].into_iter().flat_map(|state| {
        [None, Some(JobKind::Edit)].into_iter().flat_map(move |kind| {
            [None, Some(("shot".to_owned(), "1".to_owned()))].into_iter().flat_map(move |label| {
                [None, Some(Timestamp::UNIX_EPOCH)].map(|since| JobFilter {
                    state,
                    kind,
                    verdict: None,
                    label: label.clone(),
                    since,
                })
            })
        })
    });
    let failed = JobFilter { verdict: Some(JobVerdict::Fail), ..JobFilter::default() };
    for filter in filters.chain([failed]) {
        for before in [None, Some(&JobId::new())] {
            records.jobs(&ann, &filter, before, 10).await.expect("lists");
        }
    }
    records.holdings(&ann).await.expect("counts");
    records.unfinished_jobs(&ann).await.expect("counts");
    records.queue_depth().await.expect("counts");
    records.oldest_queued().await.expect("looks");
    records.queue_position(&job, 100).await.expect("counts");
    records.queue_positions(&ann, &[&job.id], 100).await.expect("counts");
    records.all_record_counts().await.expect("counts");
    records.cached_results(&ann, "a key", Timestamp::UNIX_EPOCH).await.expect("looks");
    records.stored_bytes().await.expect("counts");
    records.unnamed_blobs(&["aa".to_owned(), "cc".to_owned()]).await.expect("looks");
    for before in [None, Some(&files[1].id)] {
        records.assets(&ann, before, 10).await.expect("lists");
    }
    for state in [None, Some(retargetd::store::DeliveryState::Failed)] {
        records.deliveries(&ann, &WebhookId::new(), state, None, 10).await.expect("lists");
    }
    for kind in [DocumentKind::Rig, DocumentKind::Preset] {
        records.documents(&ann, kind).await.expect("lists");
        records.document_heads(&ann, kind).await.expect("lists");
    }
    let (batch, jobs) = batch_records::added(&records, 3, OnError::Stop).await;
    records.batches(&ann, Some(&batch.id), 10).await.expect("lists");
    records.batch_progress(&[&batch.id]).await.expect("counts");
    records.batch_jobs(&batch.id, (Some(JobState::Queued), None), Some(1), 10).await.expect("lists");
    records.failed_batch_jobs(&batch.id, false).await.expect("lists");
    records.stop_batch(&batch.id, &end(JobState::Canceled, Vec::new())).await.expect("stops");
    records.end_left_waiting(&batch.id, &end(JobState::Canceled, Vec::new())).await.expect("ends");
    records.remove_job(&jobs[0].id).await.expect("removes");
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::new(records.clone(), Blobs::local(folder.path()).expect("a folder"));
    let later = Timestamp::from_second(4_000_000_000).expect("in the year 2096");
    store.remove_oldest_ended(Some(&ann), 1).await.expect("removes");
    store.remove_oldest_ended(None, 1).await.expect("removes");
    store.sweep(later).await.expect("sweeps");
    store.remove_leftovers(later).await.expect("looks");
    records.remove_events_until(later).await.expect("removes");
    records.remove_deliveries_until(later).await.expect("removes");
}

/// The table and, where there is one, the index that a step of SQLite's plan reads from one end to the other.
fn scanned(step: &str) -> Option<(&str, Option<&str>)> {
    let mut words = step.strip_prefix("SCAN ")?.split_whitespace();
    let table = words.next()?;
    Some((table, words.skip_while(|word| *word != "INDEX").nth(1)))
}

#[tokio::test(flavor = "multi_thread")]
async fn no_statement_on_sqlite_reads_a_whole_table() {
    let statements = Statements::default();
    let subscriber = tracing_subscriber::registry().with(statements.clone());
    tracing::subscriber::set_global_default(subscriber).expect("the only one of this process");
    records::on_sqlite().await;
    outbox::on_sqlite().await;
    record_bounds::on_sqlite().await;
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("state.db");
    let records = Records::open(&file).await.expect("opens");
    look_at_everything(records.clone()).await;
    records.close().await;

    let mut database = sqlx::SqliteConnection::connect(&format!("sqlite://{}", file.display())).await.expect("opens");
    let texts = std::mem::take(&mut *statements.0.lock().expect("nobody panics"));
    let (mut explained, mut faults) = (0, Vec::new());
    for text in
        texts.iter().filter(|text| ["SELECT", "UPDATE", "DELETE", "INSERT"].iter().any(|word| text.starts_with(word)))
    {
        // Layouts of before have other tables; what brings them up to date runs once.
        let query = sqlx::query(sqlx::AssertSqlSafe(format!("EXPLAIN QUERY PLAN {text}")));
        let Ok(steps) = query.fetch_all(&mut database).await else { continue };
        explained += 1;
        let sought = FOUND_BY.iter().filter(|(condition, _)| text.starts_with("SELECT") && text.contains(condition));
        for (_, index) in sought {
            let is_found = steps.iter().any(|step| step.get::<String, _>("detail").contains(index));
            if !is_found {
                let plan: Vec<String> = steps.iter().map(|step| step.get("detail")).collect();
                faults.push(format!("not by {index}: {plan:?}\n    {text}"));
            }
        }
        for step in &steps {
            let step: String = step.get("detail");
            let is_fault = scanned(&step).is_some_and(|(table, index)| {
                LARGE.contains(&table) && !index.is_some_and(|index| MAY_BE_WALKED.contains(&index))
            });
            if is_fault && !text.contains("_sqlx_migrations") {
                faults.push(format!("{step}\n    {text}"));
            }
        }
    }
    assert!(explained > 100, "the statements were heard: {explained}");
    assert!(faults.is_empty(), "{} of {explained}:\n{}", faults.len(), faults.join("\n"));
}

/// The plans in the server's log, each with its statement in front.
fn plans(log: &str) -> impl Iterator<Item = &str> {
    log.split("  plan:\n").skip(1).map(|text| match text.find("\n2") {
        Some(end) => &text[..end],
        None => text,
    })
}

/// Whether a plan reads a large table, or an index of one, from one end to the other.
fn reads_all(plan: &str) -> Option<&str> {
    let lines: Vec<&str> = plan.lines().collect();
    lines.iter().enumerate().find_map(|(number, line)| {
        let is_of_large = |line: &str| {
            let table = line.split(" on ").nth(1).and_then(|rest| rest.split_whitespace().next());
            table.is_some_and(|table| LARGE.contains(&table))
        };
        if line.contains("Seq Scan on") && is_of_large(line) {
            return Some(*line);
        }
        // One with a condition says so in the lines that belong to it, up to the next step.
        let index = line.split_once("Scan using ").filter(|_| is_of_large(line))?.1.split_whitespace().next()?;
        let own = lines[number + 1..].iter().take_while(|line| !line.contains("->"));
        let has_condition = own.clone().any(|line| line.contains("Index Cond:"));
        (!has_condition && !MAY_BE_WALKED.contains(&index)).then_some(*line)
    })
}

#[tokio::test(flavor = "multi_thread")]
async fn no_statement_on_postgres_reads_a_whole_table() {
    let Some(server) = Postgres::start_explaining() else { return };
    // What brings the layout up to date reads all there is.
    server.records().await.close().await;
    let before = server.log().len();
    records::on_postgres(&server).await;
    outbox::on_postgres(&server).await;
    record_bounds::on_postgres(&server).await;
    let records = server.records().await;
    look_at_everything(records.clone()).await;
    records.close().await;
    let log = server.log();
    let plans: BTreeSet<&str> = plans(&log[before..]).collect();
    let faults: BTreeSet<String> =
        plans.iter().filter_map(|plan| reads_all(plan).map(|line| format!("{}\n{plan}", line.trim()))).collect();
    assert!(plans.len() > 100, "the statements were heard: {}", plans.len());
    assert!(
        faults.is_empty(),
        "{} of {}:\n{}",
        faults.len(),
        plans.len(),
        faults.into_iter().take(20).collect::<Vec<_>>().join("\n")
    );
}
