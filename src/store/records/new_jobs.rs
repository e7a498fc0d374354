//! Writing new jobs: one, or all of a batch in one transaction.

use std::collections::BTreeSet;

use sqlx::{Any, Transaction};

use super::{
    Added, BatchPlace, JobRecord, JobState, Records,
    database::{CHUNK, ours, places, rows_of},
    job_lists,
    jobs::{COLUMNS, read, to_json},
    signed,
};
use crate::store::{JobId, Principal, StoreError, WebhookId};

const NEW_COLUMNS: &str = "id, state, request, input_bytes, attempt, retry_of, created_at, finished_at, expires_at, failure, \
                           principal, priority, inputs_sha256, memory_bytes, idempotency_key, asked_sha256, kind, batch_id, \
                           batch_item, lane, webhook_id, trace_context";
const NEW_COLUMN_COUNT: usize = 22;

impl Records {
    /// Writes a new job and puts it into the queue. Doing it again changes nothing.
    ///
    /// # Errors
    /// When the database fails. The job may be there all the same.
    pub async fn add_job(&self, job: &JobRecord) -> Result<Added, StoreError> {
        let mut transaction = self.begin().await?;
        let jobs = std::slice::from_ref(job);
        if insert(&mut transaction, jobs).await? == 0 {
            let key = job.idempotency.as_ref().map(|word| &word.key);
            let query =
                ours(format!("SELECT {COLUMNS} FROM jobs WHERE id = $1 OR (principal = $2 AND idempotency_key = $3)"));
            let query = sqlx::query(query).bind(job.id.as_str()).bind(job.principal.as_str()).bind(key);
            return Ok(Added::Before(Box::new(read(&query.fetch_one(&mut *transaction).await?)?)));
        }
        if !self.insert_what_belongs_to(&mut transaction, &job.principal, jobs).await? {
            return Ok(Added::FileMissing);
        }
        self.commit(transaction).await?;
        Ok(Added::New)
    }

    /// Writes what goes with new jobs of one owner, and tells the others that some wait. Gives `false` where a file of one that
    /// waits is not there, so that the transaction is to be given up.
    pub(super) async fn insert_what_belongs_to(
        &self,
        transaction: &mut Transaction<'static, Any>,
        owner: &Principal,
        jobs: &[JobRecord],
    ) -> Result<bool, StoreError> {
        let waiting: Vec<&JobRecord> = jobs.iter().filter(|job| job.state == JobState::Queued).collect();
        // One file may be both source and target.
        let inputs: BTreeSet<(&str, &str)> = waiting
            .iter()
            .flat_map(|job| job.request.inputs().map(|(_, input)| (job.id.as_str(), input.asset.as_str())))
            .collect();
        let files: Vec<&str> = inputs.iter().map(|(_, asset)| *asset).collect::<BTreeSet<_>>().into_iter().collect();
        for files in files.chunks(CHUNK) {
            let query = ours(format!(
                "SELECT id FROM assets WHERE principal = $1 AND id IN ({}) ORDER BY id {}",
                places(2, files.len()),
                self.dialect.keep_rows()
            ));
            let query = files.iter().fold(sqlx::query(query).bind(owner.as_str()), |query, file| query.bind(*file));
            if query.fetch_all(&mut **transaction).await?.len() < files.len() {
                return Ok(false);
            }
        }
        let inputs: Vec<(&str, &str)> = inputs.into_iter().collect();
        for inputs in inputs.chunks(CHUNK) {
            let query = ours(format!("INSERT INTO job_inputs (job_id, asset_id) VALUES {}", rows_of(inputs.len(), 2)));
            let query = inputs.iter().fold(sqlx::query(query), |query, (job, asset)| query.bind(*job).bind(*asset));
            query.execute(&mut **transaction).await?;
        }
        job_lists::insert_labels(transaction, jobs).await?;
        let Some(first) = waiting.first() else { return Ok(true) };
        // The row of a caller's turn goes when nobody has seen the caller for long, and never under a job that is being added.
        let query = "INSERT INTO turns (principal, served, seen_at) VALUES ($1, 0, $2) \
                     ON CONFLICT (principal) DO UPDATE SET seen_at = excluded.seen_at";
        sqlx::query(query)
            .bind(owner.as_str())
            .bind(first.created_at.as_millisecond())
            .execute(&mut **transaction)
            .await?;
        // Nobody waits for the end of a job yet that is not known yet, so one notice does for all: it wakes who takes jobs up.
        self.notify(transaction, &first.id, JobState::Queued).await?;
        Ok(true)
    }
}

/// Writes the rows of new jobs; those that are there already are left. Gives how many are new.
pub(super) async fn insert(transaction: &mut Transaction<'static, Any>, jobs: &[JobRecord]) -> Result<u64, StoreError> {
    let mut added = 0;
    for jobs in jobs.chunks(CHUNK) {
        let rows = rows_of(jobs.len(), NEW_COLUMN_COUNT);
        let mut query =
            sqlx::query(ours(format!("INSERT INTO jobs ({NEW_COLUMNS}) VALUES {rows} ON CONFLICT DO NOTHING")));
        for job in jobs {
            let (key, asked_sha256) = job.idempotency.as_ref().map(|word| (&word.key, &word.asked_sha256)).unzip();
            let failure = job.failure.as_ref().map(|failure| to_json(failure, &job.id)).transpose()?;
            let (batch, item) = job.batch.as_ref().map(|BatchPlace { batch, item }| (batch.as_str(), *item)).unzip();
            query = query
                .bind(job.id.as_str())
                .bind(job.state.name())
                .bind(to_json(&job.request, &job.id)?)
                .bind(signed(job.input_bytes))
                .bind(i64::from(job.attempt))
                .bind(job.retry_of.as_ref().map(JobId::as_str))
                .bind(job.created_at.as_millisecond())
                .bind(job.finished_at.map(jiff::Timestamp::as_millisecond))
                .bind(job.expires_at.map(jiff::Timestamp::as_millisecond))
                .bind(failure)
                .bind(job.principal.as_str())
                .bind(i64::from(job.priority))
                .bind(&job.inputs_sha256)
                .bind(signed(job.memory_bytes))
                .bind(key)
                .bind(asked_sha256)
                .bind(job.kind.name())
                .bind(batch)
                .bind(item.map(signed))
                .bind(job.lane().number())
                .bind(job.request.webhook.as_ref().map(WebhookId::as_str))
                .bind(&job.trace_context);
        }
        added += query.execute(&mut **transaction).await?.rows_affected();
    }
    Ok(added)
}
