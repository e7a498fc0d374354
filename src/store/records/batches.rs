//! Records of batches. A batch has no state of its own: what it is follows from its jobs.

use std::collections::BTreeMap;

use sqlx::{Row, any::AnyRow};

use super::{
    AddedAgain, AddedBatch, BatchProgress, BatchRecord, FinishedJob, Idempotency, JobRecord, JobState, JobVerdict,
    OnError, Page, Records, StoppedBatch, count,
    database::{CHUNK, ours, places},
    jobs::{COLUMNS, read as read_job, to_json},
    new_jobs, optional_time, principal, read_id, signed, time,
};
use crate::store::{BatchId, JobId, Principal, StoreError};

fn read(row: &AnyRow) -> Result<BatchRecord, StoreError> {
    let id = read_id(row, "id", BatchId::parse)?;
    let unreadable = |reason: String| StoreError::Unreadable { record: id.to_string(), reason };
    let (on_error, labels): (String, String) = (row.try_get("on_error")?, row.try_get("labels")?);
    let (key, asked): (Option<String>, Option<String>) =
        (row.try_get("idempotency_key")?, row.try_get("asked_sha256")?);
    Ok(BatchRecord {
        principal: principal(row)?,
        created_at: time(row, "created_at")?,
        on_error: OnError::from_name(&on_error).ok_or_else(|| unreadable(format!("'{on_error}' is unknown")))?,
        items: count(row, "items")?,
        labels: serde_json::from_str(&labels).map_err(|error| unreadable(error.to_string()))?,
        idempotency: key.zip(asked).map(|(key, asked_sha256)| Idempotency { key, asked_sha256 }),
        id,
    })
}

impl Records {
    /// Writes a batch with all its jobs, which must be of the batch's owner and in the order of its items.
    ///
    /// # Errors
    /// When the database fails. The batch may be there all the same.
    pub async fn add_batch(&self, batch: &BatchRecord, jobs: &[JobRecord]) -> Result<AddedBatch, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "INSERT INTO batches (id, principal, created_at, on_error, items, labels, idempotency_key, asked_sha256) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7, $8) ON CONFLICT DO NOTHING";
        let (key, asked_sha256) = batch.idempotency.as_ref().map(|word| (&word.key, &word.asked_sha256)).unzip();
        let labels = serde_json::to_string(&batch.labels)
            .map_err(|error| StoreError::Unreadable { record: batch.id.to_string(), reason: error.to_string() })?;
        let done = sqlx::query(query)
            .bind(batch.id.as_str())
            .bind(batch.principal.as_str())
            .bind(batch.created_at.as_millisecond())
            .bind(batch.on_error.name())
            .bind(signed(batch.items))
            .bind(labels)
            .bind(key)
            .bind(asked_sha256)
            .execute(&mut *transaction)
            .await?;
        if done.rows_affected() == 0 {
            let query = "SELECT * FROM batches WHERE id = $1 OR (principal = $2 AND idempotency_key = $3)";
            let query = sqlx::query(query).bind(batch.id.as_str()).bind(batch.principal.as_str()).bind(key);
            return Ok(AddedBatch::Before(Box::new(read(&query.fetch_one(&mut *transaction).await?)?)));
        }
        new_jobs::insert(&mut transaction, jobs).await?;
        if !self.insert_what_belongs_to(&mut transaction, &batch.principal, jobs).await? {
            return Ok(AddedBatch::FileMissing);
        }
        self.commit(transaction).await?;
        Ok(AddedBatch::New)
    }

    /// Puts new jobs in the place of those that each repeats (its `retry_of`), which must have ended and belong to one owner.
    ///
    /// # Errors
    /// When the database fails. The jobs may be there all the same.
    pub async fn add_again(&self, owner: &Principal, jobs: &[JobRecord]) -> Result<AddedAgain, StoreError> {
        let mut transaction = self.begin().await?;
        let older: Vec<&str> = jobs.iter().filter_map(|job| job.retry_of.as_ref().map(JobId::as_str)).collect();
        for older in older.chunks(CHUNK) {
            let query = ours(format!(
                "UPDATE jobs SET is_superseded = 1 WHERE is_superseded = 0 AND id IN ({})",
                places(1, older.len())
            ));
            let query = older.iter().fold(sqlx::query(query), |query, id| query.bind(*id));
            if query.execute(&mut *transaction).await?.rows_affected() < older.len() as u64 {
                return Ok(AddedAgain::Outrun);
            }
        }
        new_jobs::insert(&mut transaction, jobs).await?;
        if !self.insert_what_belongs_to(&mut transaction, owner, jobs).await? {
            return Ok(AddedAgain::FileMissing);
        }
        self.commit(transaction).await?;
        Ok(AddedAgain::New)
    }

    /// A batch; to who does not own it, there is none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn batch(&self, owner: &Principal, id: &BatchId) -> Result<Option<BatchRecord>, StoreError> {
        let query = "SELECT * FROM batches WHERE id = $1 AND principal = $2";
        self.optional(sqlx::query(query).bind(id.as_str()).bind(owner.as_str())).await?.as_ref().map(read).transpose()
    }

    /// The batch that its owner asked for with that key.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn batch_asked_with(&self, owner: &Principal, key: &str) -> Result<Option<BatchRecord>, StoreError> {
        let query = "SELECT * FROM batches WHERE principal = $1 AND idempotency_key = $2";
        self.optional(sqlx::query(query).bind(owner.as_str()).bind(key)).await?.as_ref().map(read).transpose()
    }

    /// Up to `most` batches of one owner, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn batches(
        &self,
        owner: &Principal,
        before: Option<&BatchId>,
        most: usize,
    ) -> Result<Page<BatchRecord>, StoreError> {
        let query = match before {
            Some(_) => "SELECT * FROM batches WHERE principal = $1 AND id < $3 ORDER BY id DESC LIMIT $2",
            None => "SELECT * FROM batches WHERE principal = $1 ORDER BY id DESC LIMIT $2",
        };
        let query = sqlx::query(query).bind(owner.as_str()).bind(signed(most as u64 + 1));
        let query = before.into_iter().fold(query, |query, id| query.bind(id.as_str()));
        Ok(Page::cut(self.all(query).await?.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// What the jobs of batches say of each.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn batch_progress(&self, ids: &[&BatchId]) -> Result<BTreeMap<BatchId, BatchProgress>, StoreError> {
        let mut found: BTreeMap<BatchId, BatchProgress> = BTreeMap::new();
        for ids in ids.chunks(CHUNK) {
            let query = ours(format!(
                "SELECT batch_id, state, verdict, is_superseded, CAST(COUNT(*) AS BIGINT) AS jobs, MIN(started_at) AS started_at, \
                 MAX(finished_at) AS finished_at, MAX(expires_at) AS expires_at FROM jobs WHERE batch_id IN ({}) \
                 GROUP BY batch_id, state, verdict, is_superseded",
                places(1, ids.len())
            ));
            let query = ids.iter().fold(sqlx::query(query), |query, id| query.bind(id.as_str()));
            for row in self.all(query).await? {
                let of = found.entry(read_id(&row, "batch_id", BatchId::parse)?).or_default();
                let jobs = count(&row, "jobs")?;
                if count(&row, "is_superseded")? > 0 {
                    of.retried += jobs;
                    continue;
                }
                let Some(state) = JobState::from_name(row.try_get("state")?) else { continue };
                *of.jobs.entry(state).or_default() += jobs;
                let verdict: Option<String> = row.try_get("verdict")?;
                if let Some(verdict) = verdict.as_deref().and_then(JobVerdict::from_name) {
                    *of.verdicts.entry(verdict).or_default() += jobs;
                }
                let started_at = optional_time(&row, "started_at")?;
                of.started_at = of.started_at.into_iter().chain(started_at).min();
                of.finished_at = of.finished_at.max(optional_time(&row, "finished_at")?);
                of.expires_at = of.expires_at.max(optional_time(&row, "expires_at")?);
            }
        }
        Ok(found)
    }

    /// Up to `most` jobs of a batch, whoever owns it, in the order of its items and behind item `after`: the newest of each, and only
    /// those in `state` where that is given.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn batch_jobs(
        &self,
        id: &BatchId,
        (state, verdict): (Option<JobState>, Option<JobVerdict>),
        after: Option<u64>,
        most: usize,
    ) -> Result<Page<JobRecord>, StoreError> {
        // Names of closed lists, never what a caller sent.
        let in_state = state.map_or_else(String::new, |state| format!("AND state = '{}'", state.name()));
        let judged = verdict.map_or_else(String::new, |verdict| format!("AND verdict = '{}'", verdict.name()));
        let query = ours(format!(
            "SELECT {COLUMNS} FROM jobs WHERE batch_id = $1 AND is_superseded = 0 {in_state} {judged} \
             AND batch_item > $2 ORDER BY batch_item LIMIT $3"
        ));
        let query = sqlx::query(query).bind(id.as_str()).bind(after.map_or(-1, signed)).bind(signed(most as u64 + 1));
        Ok(Page::cut(self.all(query).await?.iter().map(read_job).collect::<Result<_, _>>()?, most))
    }

    /// The items of a batch that failed, or that did not start since another one failed, and where `with_canceled` those that were canceled:
    /// the newest job of each.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn failed_batch_jobs(&self, id: &BatchId, with_canceled: bool) -> Result<Vec<JobRecord>, StoreError> {
        // What was canceled on request has no failure.
        let canceled = if with_canceled { "" } else { " AND failure IS NOT NULL" };
        let query = ours(format!(
            "SELECT {COLUMNS} FROM jobs WHERE batch_id = $1 AND is_superseded = 0 \
             AND (state = 'failed' OR (state = 'canceled'{canceled})) ORDER BY batch_item"
        ));
        self.all(sqlx::query(query).bind(id.as_str())).await?.iter().map(read_job).collect()
    }

    /// Ends the jobs of a batch that wait as `end` says, and tells those to stop that run. What is just changing hands is left, so that
    /// nobody waits for one who waits for him.
    ///
    /// # Errors
    /// When the database fails. The changes may have been made all the same.
    pub async fn stop_batch(&self, id: &BatchId, end: &FinishedJob) -> Result<StoppedBatch, StoreError> {
        let mut transaction = self.begin().await?;
        let ended = self.end_waiting(&mut transaction, id, end).await?;
        let query = ours(format!(
            "UPDATE jobs SET state = 'canceling' WHERE id IN (SELECT id FROM jobs WHERE batch_id = $1 AND \
             state = 'running' {}) RETURNING id",
            self.dialect.lock_free_rows()
        ));
        let rows = sqlx::query(query).bind(id.as_str()).fetch_all(&mut *transaction).await?;
        let stopping = rows.iter().map(|row| read_id(row, "id", JobId::parse)).collect::<Result<Vec<_>, _>>()?;
        let query =
            "SELECT CAST(COUNT(*) AS BIGINT) AS jobs FROM jobs WHERE batch_id = $1 AND state IN ('queued', 'running')";
        let left = sqlx::query(query).bind(id.as_str()).fetch_one(&mut *transaction).await?;
        self.commit(transaction).await?;
        Ok(StoppedBatch { ended, stopping, has_more: count(&left, "jobs")? > 0 })
    }

    /// Ends the jobs of a batch that still wait although it was stopped: they were changing hands just then, and went back. Waits for those
    /// that change hands now, and has nothing that they wait for. Gives how many there were.
    ///
    /// # Errors
    /// When the database fails. The changes may have been made all the same.
    pub async fn end_left_waiting(&self, id: &BatchId, end: &FinishedJob) -> Result<u64, StoreError> {
        let mut transaction = self.begin().await?;
        let query = ours(format!(
            "SELECT id FROM jobs WHERE batch_id = $1 AND state = 'queued' ORDER BY id {}",
            self.dialect.lock_rows()
        ));
        let left = sqlx::query(query).bind(id.as_str()).fetch_all(&mut *transaction).await?;
        if left.is_empty() {
            return Ok(0);
        }
        let ended = self.end_waiting(&mut transaction, id, end).await?;
        self.commit(transaction).await?;
        Ok(ended)
    }

    /// Ends the jobs of a batch that wait; part of a transaction. Gives how many there were.
    pub(super) async fn end_waiting(
        &self,
        transaction: &mut sqlx::Transaction<'static, sqlx::Any>,
        id: &BatchId,
        end: &FinishedJob,
    ) -> Result<u64, StoreError> {
        let query = ours(format!(
            "UPDATE jobs SET state = $2, finished_at = $3, expires_at = $4, failure = $5, progress = NULL WHERE id IN \
             (SELECT id FROM jobs WHERE batch_id = $1 AND state = 'queued' {})",
            self.dialect.lock_free_rows()
        ));
        let failure = end.failure.as_ref().map(|failure| to_json(failure, id)).transpose()?;
        let done = sqlx::query(query)
            .bind(id.as_str())
            .bind(end.state.name())
            .bind(end.finished_at.as_millisecond())
            .bind(end.expires_at.as_millisecond())
            .bind(failure)
            .execute(&mut **transaction)
            .await?;
        Ok(done.rows_affected())
    }
}
