//! Records of jobs.

use jiff::Timestamp;
use serde::{Serialize, de::DeserializeOwned};
use sqlx::{Row, Sqlite, Transaction, sqlite::SqliteRow};

use super::{FinishedJob, JobRecord, JobState, Page, Records, count, optional_time, read_id, results, signed, time};
use crate::store::{JobId, StoreError};

/// Everything but the documents, which can be large and are read by themselves.
const COLUMNS: &str = "id, state, request, input_bytes, attempt, retry_of, created_at, started_at, finished_at, \
                       expires_at, warnings, failure";

fn read(row: &SqliteRow) -> Result<JobRecord, StoreError> {
    let id = read_id(row, "id", JobId::parse)?;
    let unreadable = |reason: String| StoreError::Unreadable { record: id.to_string(), reason };
    let state: String = row.try_get("state")?;
    let failure: Option<String> = row.try_get("failure")?;
    let retry_of: Option<String> = row.try_get("retry_of")?;
    Ok(JobRecord {
        state: JobState::from_name(&state).ok_or_else(|| unreadable(format!("no state is called '{state}'")))?,
        request: from_json(row.try_get("request")?).map_err(unreadable)?,
        input_bytes: count(row, "input_bytes")?,
        attempt: u32::try_from(count(row, "attempt")?).unwrap_or(u32::MAX),
        retry_of: retry_of
            .map(|text| JobId::parse(&text).map_err(|error| unreadable(error.to_string())))
            .transpose()?,
        created_at: time(row, "created_at")?,
        started_at: optional_time(row, "started_at")?,
        finished_at: optional_time(row, "finished_at")?,
        expires_at: optional_time(row, "expires_at")?,
        warnings: count(row, "warnings")?,
        failure: failure.map(|text| from_json(&text)).transpose().map_err(unreadable)?,
        id,
    })
}

fn from_json<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    serde_json::from_str(text).map_err(|error| error.to_string())
}

fn to_json(value: &impl Serialize, record: &JobId) -> Result<String, StoreError> {
    serde_json::to_string(value)
        .map_err(|error| StoreError::Unreadable { record: record.to_string(), reason: error.to_string() })
}

impl Records {
    /// Writes a new job. Gives `false`, and writes nothing, when one of its files is no longer there.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn add_job(&self, job: &JobRecord) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "INSERT INTO jobs (id, state, request, input_bytes, attempt, retry_of, created_at) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7)";
        sqlx::query(query)
            .bind(job.id.as_str())
            .bind(job.state.name())
            .bind(to_json(&job.request, &job.id)?)
            .bind(signed(job.input_bytes))
            .bind(i64::from(job.attempt))
            .bind(job.retry_of.as_ref().map(JobId::as_str))
            .bind(job.created_at.as_millisecond())
            .execute(&mut *transaction)
            .await?;
        for (_, input) in job.request.inputs() {
            let query = "SELECT 1 FROM assets WHERE id = $1";
            if sqlx::query(query).bind(input.asset.as_str()).fetch_optional(&mut *transaction).await?.is_none() {
                return Ok(false);
            }
            // One file may be both source and target.
            let query = "INSERT OR IGNORE INTO job_inputs (job_id, asset_id) VALUES ($1, $2)";
            sqlx::query(query).bind(job.id.as_str()).bind(input.asset.as_str()).execute(&mut *transaction).await?;
        }
        transaction.commit().await?;
        Ok(true)
    }

    /// A job.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job(&self, id: &JobId) -> Result<Option<JobRecord>, StoreError> {
        let query = sqlx::AssertSqlSafe(format!("SELECT {COLUMNS} FROM jobs WHERE id = $1"));
        let row = sqlx::query(query).bind(id.as_str()).fetch_optional(&self.pool).await?;
        row.as_ref().map(read).transpose()
    }

    /// Up to `most` jobs, newest first, that are older than `before` and in `state`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn jobs(
        &self,
        state: Option<JobState>,
        before: Option<&JobId>,
        most: usize,
    ) -> Result<Page<JobRecord>, StoreError> {
        let query = sqlx::AssertSqlSafe(format!(
            "SELECT {COLUMNS} FROM jobs WHERE ($1 IS NULL OR id < $1) AND ($2 IS NULL OR state = $2) \
             ORDER BY id DESC LIMIT $3"
        ));
        let rows = sqlx::query(query)
            .bind(before.map(JobId::as_str))
            .bind(state.map(JobState::name))
            .bind(signed(most as u64 + 1))
            .fetch_all(&self.pool)
            .await?;
        Ok(Page::cut(rows.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// All jobs that have not ended, oldest first.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn unfinished_jobs(&self) -> Result<Vec<JobRecord>, StoreError> {
        let query = sqlx::AssertSqlSafe(format!(
            "SELECT {COLUMNS} FROM jobs WHERE state IN ('queued', 'running', 'canceling') ORDER BY id"
        ));
        sqlx::query(query).fetch_all(&self.pool).await?.iter().map(read).collect()
    }

    /// Moves a job from one unfinished state to another. `attempt` and `started_at` are written along. Gives `false`, and
    /// writes nothing, when the job is not in state `from`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn move_job(
        &self,
        id: &JobId,
        (from, to): (JobState, JobState),
        attempt: u32,
        started_at: Option<Timestamp>,
    ) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "UPDATE jobs SET state = $3, attempt = $4, started_at = $5 WHERE id = $1 AND state = $2";
        let done = sqlx::query(query)
            .bind(id.as_str())
            .bind(from.name())
            .bind(to.name())
            .bind(i64::from(attempt))
            .bind(started_at.map(Timestamp::as_millisecond))
            .execute(&mut *transaction)
            .await?;
        transaction.commit().await?;
        Ok(done.rows_affected() > 0)
    }

    /// Ends a job that is in state `from`: state, documents and results in one transaction. Gives `false`, and writes
    /// nothing, when the job is not in that state.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn finish_job(&self, id: &JobId, from: JobState, finished: &FinishedJob) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        if !write_end(&mut transaction, id, from, finished).await? {
            return Ok(false);
        }
        for (position, result) in finished.results.iter().enumerate() {
            results::insert(&mut transaction, result, position).await?;
        }
        transaction.commit().await?;
        Ok(true)
    }

    /// The report of a job, as JSON.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_report(&self, id: &JobId) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar::<_, Option<String>>("SELECT report FROM jobs WHERE id = $1");
        Ok(query.bind(id.as_str()).fetch_optional(&self.pool).await?.flatten())
    }

    /// The resolved spec of a job, as JSON.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_resolved_spec(&self, id: &JobId) -> Result<Option<String>, StoreError> {
        let query = sqlx::query_scalar::<_, Option<String>>("SELECT resolved_spec FROM jobs WHERE id = $1");
        Ok(query.bind(id.as_str()).fetch_optional(&self.pool).await?.flatten())
    }

    /// Removes a job that has ended, with its results. Gives the digests of its blobs, or `None` when the job is not there
    /// or has not ended.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn remove_job(&self, id: &JobId) -> Result<Option<Vec<String>>, StoreError> {
        let mut transaction = self.begin().await?;
        let digests = sqlx::query_scalar::<_, String>("SELECT sha256 FROM results WHERE job_id = $1")
            .bind(id.as_str())
            .fetch_all(&mut *transaction)
            .await?;
        let query = "DELETE FROM jobs WHERE id = $1 AND state IN ('succeeded', 'failed', 'canceled')";
        let done = sqlx::query(query).bind(id.as_str()).execute(&mut *transaction).await?;
        transaction.commit().await?;
        Ok((done.rows_affected() > 0).then_some(digests))
    }
}

async fn write_end(
    transaction: &mut Transaction<'static, Sqlite>,
    id: &JobId,
    from: JobState,
    finished: &FinishedJob,
) -> Result<bool, StoreError> {
    let query = "UPDATE jobs SET state = $3, finished_at = $4, expires_at = $5, failure = $6, report = $7, \
                 resolved_spec = $8, warnings = $9 WHERE id = $1 AND state = $2";
    let failure = finished.failure.as_ref().map(|failure| to_json(failure, id)).transpose()?;
    let done = sqlx::query(query)
        .bind(id.as_str())
        .bind(from.name())
        .bind(finished.state.name())
        .bind(finished.finished_at.as_millisecond())
        .bind(finished.expires_at.as_millisecond())
        .bind(failure)
        .bind(&finished.report)
        .bind(&finished.resolved_spec)
        .bind(signed(finished.warnings))
        .execute(&mut **transaction)
        .await?;
    Ok(done.rows_affected() > 0)
}
