//! Records of jobs.

use serde::{Serialize, de::DeserializeOwned};
use sqlx::{Any, Row, Transaction, any::AnyRow};

use super::{
    BatchPlace, Ended, FinishedJob, Idempotency, JobKind, JobRecord, JobRequest, JobState, JobTask, Records, count,
    database::ours, engine_time::used, optional_time, principal, read_id, results, signed, time, verdict,
};
use crate::store::{BatchId, JobId, LeaseId, Principal, StoreError};

/// Everything but the documents, which can be large and are read by themselves.
pub(super) const COLUMNS: &str = "id, state, request, input_bytes, attempt, retry_of, created_at, started_at, \
                                  finished_at, expires_at, warnings, verdict, verdict_reason, coverage, failure, principal, priority, inputs_sha256, \
                                  memory_bytes, crashes, retries, lease, progress, idempotency_key, asked_sha256, kind, \
                                  cache_key, cached_from, batch_id, batch_item, trace_context";

/// The same of a table, where another has some of these names as well.
pub(super) fn columns_of(table: &str) -> String {
    COLUMNS.split(", ").map(|column| format!("{table}.{column}")).collect::<Vec<_>>().join(", ")
}

pub(super) fn read(row: &AnyRow) -> Result<JobRecord, StoreError> {
    let id = read_id(row, "id", JobId::parse)?;
    let unreadable = |reason: String| StoreError::Unreadable { record: id.to_string(), reason };
    let (state, kind): (String, String) = (row.try_get("state")?, row.try_get("kind")?);
    let failure: Option<String> = row.try_get("failure")?;
    let progress: Option<String> = row.try_get("progress")?;
    let key: Option<String> = row.try_get("idempotency_key")?;
    let asked: Option<String> = row.try_get("asked_sha256")?;
    let small = |column: &str| Ok::<_, StoreError>(u32::try_from(count(row, column)?).unwrap_or(u32::MAX));
    let mut request: JobRequest = from_json(row.try_get("request")?).map_err(unreadable)?;
    if request.task == JobTask::default() {
        // Requests of before 0.2 leave it to the config and this column what the task is.
        let kind = JobKind::from_name(&kind);
        request.task =
            JobTask::of_kind(kind.ok_or_else(|| unreadable(format!("no kind of job is called '{kind:?}'")))?);
    }
    Ok(JobRecord {
        state: JobState::from_name(&state).ok_or_else(|| unreadable(format!("no state is called '{state}'")))?,
        request,
        input_bytes: count(row, "input_bytes")?,
        attempt: small("attempt")?,
        retry_of: optional_id(row, "retry_of", JobId::parse).map_err(unreadable)?,
        created_at: time(row, "created_at")?,
        started_at: optional_time(row, "started_at")?,
        finished_at: optional_time(row, "finished_at")?,
        expires_at: optional_time(row, "expires_at")?,
        warnings: count(row, "warnings")?,
        judgment: verdict::read(row)?,
        failure: failure.map(|text| from_json(&text)).transpose().map_err(unreadable)?,
        principal: principal(row)?,
        priority: i32::try_from(row.try_get::<i64, _>("priority")?).unwrap_or(0),
        inputs_sha256: row.try_get("inputs_sha256")?,
        memory_bytes: count(row, "memory_bytes")?,
        crashes: small("crashes")?,
        retries: small("retries")?,
        idempotency: key.zip(asked).map(|(key, asked_sha256)| Idempotency { key, asked_sha256 }),
        lease: optional_id(row, "lease", LeaseId::parse).map_err(unreadable)?,
        progress: progress.map(|text| from_json(&text)).transpose().map_err(unreadable)?,
        cache_key: row.try_get("cache_key")?,
        cached_from: optional_id(row, "cached_from", JobId::parse).map_err(unreadable)?,
        batch: batch_place(row)?,
        trace_context: row.try_get("trace_context")?,
        id,
    })
}

/// The batch of a job, and which item of it the job is for.
pub(super) fn batch_place(row: &AnyRow) -> Result<Option<BatchPlace>, StoreError> {
    let (id, item): (Option<String>, Option<i64>) = (row.try_get("batch_id")?, row.try_get("batch_item")?);
    let unreadable = |id: &str, reason: String| StoreError::Unreadable { record: id.to_owned(), reason };
    let place = id.zip(item).map(|(id, item)| {
        let batch = BatchId::parse(&id).map_err(|error| unreadable(&id, error.to_string()))?;
        Ok(BatchPlace { batch, item: u64::try_from(item).unwrap_or(0) })
    });
    place.transpose()
}

fn optional_id<T>(
    row: &AnyRow,
    column: &str,
    parse: fn(&str) -> Result<T, crate::store::IdError>,
) -> Result<Option<T>, String> {
    let text: Option<String> = row.try_get(column).map_err(|error| error.to_string())?;
    text.map(|text| parse(&text).map_err(|error| error.to_string())).transpose()
}

fn from_json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

pub(super) fn to_json<T: Serialize>(value: &T, record: &impl std::fmt::Display) -> Result<String, StoreError> {
    serde_json::to_string(value)
        .map_err(|error| StoreError::Unreadable { record: record.to_string(), reason: error.to_string() })
}

impl Records {
    /// A job, whoever owns it.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job(&self, id: &JobId) -> Result<Option<JobRecord>, StoreError> {
        let query = ours(format!("SELECT {COLUMNS} FROM jobs WHERE id = $1"));
        self.optional(sqlx::query(query).bind(id.as_str())).await?.as_ref().map(read).transpose()
    }

    /// The job that its owner asked for with that key.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_asked_with(&self, owner: &Principal, key: &str) -> Result<Option<JobRecord>, StoreError> {
        let query = ours(format!("SELECT {COLUMNS} FROM jobs WHERE principal = $1 AND idempotency_key = $2"));
        self.optional(sqlx::query(query).bind(owner.as_str()).bind(key)).await?.as_ref().map(read).transpose()
    }

    /// Tells a running job's worker that somebody wants the job to stop. Gives `false`, and writes nothing, when the job does not
    /// run.
    ///
    /// # Errors
    /// When the database fails. The change may have been made all the same.
    pub async fn request_cancel(&self, id: &JobId) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "UPDATE jobs SET state = 'canceling' WHERE id = $1 AND state = 'running'";
        let done = sqlx::query(query).bind(id.as_str()).execute(&mut *transaction).await?;
        self.commit(transaction).await?;
        Ok(done.rows_affected() > 0)
    }

    /// Ends a job that is in state `from` and in the hands of `lease`: state, documents, results and what that does to its batch in
    /// one transaction. Writes nothing when it is in another state or in other hands. What waits is in nobody's.
    ///
    /// # Errors
    /// When the database fails. The end may have been written all the same.
    pub async fn finish_job(
        &self,
        id: &JobId,
        (from, lease): (JobState, Option<&LeaseId>),
        finished: &FinishedJob,
    ) -> Result<Ended, StoreError> {
        let mut transaction = self.begin().await?;
        let ended = self.write_end(&mut transaction, id, (from, lease), finished).await?;
        if ended.is_written() {
            self.commit(transaction).await?;
        }
        Ok(ended)
    }

    /// Part of the transaction in which a job ends.
    pub(super) async fn write_end(
        &self,
        transaction: &mut Transaction<'static, Any>,
        id: &JobId,
        (from, lease): (JobState, Option<&LeaseId>),
        finished: &FinishedJob,
    ) -> Result<Ended, StoreError> {
        let query = ours(format!(
            "UPDATE jobs SET state = $4, finished_at = $5, expires_at = $6, failure = $7, report = $8, \
             resolved_spec = $9, warnings = $10, cache_key = $11, cached_from = $12, lease_expires_at = NULL, \
             progress = NULL, verdict = $13, verdict_reason = $14, coverage = $15, charged = {}, taken_at = NULL \
             WHERE id = $1 AND state = $2 AND COALESCE(lease, '') = $3",
            used(self.dialect)
        ));
        let failure = finished.failure.as_ref().map(|failure| to_json(failure, id)).transpose()?;
        let judgment = finished.judgment.as_ref();
        let done = sqlx::query(query)
            .bind(id.as_str())
            .bind(from.name())
            .bind(lease.map_or("", LeaseId::as_str))
            .bind(finished.state.name())
            .bind(finished.finished_at.as_millisecond())
            .bind(finished.expires_at.as_millisecond())
            .bind(failure)
            .bind(&finished.report)
            .bind(&finished.resolved_spec)
            .bind(signed(finished.warnings))
            .bind(&finished.cache_key)
            .bind(finished.cached_from.as_ref().map(JobId::as_str))
            .bind(judgment.map(|judgment| judgment.verdict.name()))
            .bind(judgment.map(|judgment| judgment.reason.as_str()))
            .bind(judgment.and_then(|judgment| judgment.coverage))
            .execute(&mut **transaction)
            .await?;
        if done.rows_affected() == 0 {
            return Ok(Ended::Elsewhere);
        }
        for (position, result) in finished.results.iter().enumerate() {
            results::insert(transaction, result, position).await?;
        }
        Ok(Ended::Written { stopped: self.stop_batch_of(transaction, id, finished).await? })
    }

    /// Ends what waits of the batch of a job that has failed, where the batch is to stop then; part of the transaction in which the job
    /// ends. Gives how many that were.
    async fn stop_batch_of(
        &self,
        transaction: &mut Transaction<'static, Any>,
        id: &JobId,
        finished: &FinishedJob,
    ) -> Result<u64, StoreError> {
        let Some(failure) = finished.stops_batch.as_ref().filter(|_| finished.state == JobState::Failed) else {
            return Ok(0);
        };
        let query =
            "SELECT batch_id FROM jobs JOIN batches ON batches.id = batch_id WHERE jobs.id = $1 AND on_error = 'stop'";
        let row = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut **transaction).await?;
        let Some(row) = row else { return Ok(0) };
        let batch = read_id(&row, "batch_id", BatchId::parse)?;
        let end = FinishedJob { state: JobState::Canceled, failure: Some(failure.clone()), ..finished.clone() };
        self.end_waiting(transaction, &batch, &end).await
    }

    /// The report of a job, as JSON; to who does not own the job, there is none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_report(&self, owner: &Principal, id: &JobId) -> Result<Option<String>, StoreError> {
        self.job_document(owner, id, "SELECT report AS document FROM jobs WHERE id = $1 AND principal = $2").await
    }

    /// The resolved spec of a job, as JSON; to who does not own the job, there is none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_resolved_spec(&self, owner: &Principal, id: &JobId) -> Result<Option<String>, StoreError> {
        self.job_document(owner, id, "SELECT resolved_spec AS document FROM jobs WHERE id = $1 AND principal = $2")
            .await
    }

    async fn job_document(
        &self,
        owner: &Principal,
        id: &JobId,
        query: &'static str,
    ) -> Result<Option<String>, StoreError> {
        let row = self.optional(sqlx::query(query).bind(id.as_str()).bind(owner.as_str())).await?;
        Ok(row.map(|row| row.try_get("document")).transpose()?.flatten())
    }

    /// Removes a job that has ended, with its results. Gives the digests of its blobs, or `None` when the job is not there
    /// or has not ended.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn remove_job(&self, id: &JobId) -> Result<Option<Vec<String>>, StoreError> {
        let mut transaction = self.begin().await?;
        let query = ours(format!(
            "SELECT id FROM jobs WHERE id = $1 AND state IN ('succeeded', 'failed', 'canceled') {}",
            self.dialect.lock_rows()
        ));
        let found = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut *transaction).await?;
        if found.is_none() {
            return Ok(None);
        }
        let digests = self.remove_jobs(&mut transaction, &[id.to_string()]).await?;
        self.commit(transaction).await?;
        Ok(Some(digests))
    }
}
