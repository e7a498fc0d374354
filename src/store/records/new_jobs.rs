//! Writing new jobs: one, or all of a batch in one transaction.

use std::collections::BTreeSet;

use sqlx::{Any, Transaction};

use super::{
    Added, AssetRecord, BatchPlace, JobRecord, JobState, Records, assets,
    database::{CHUNK, ours, rows_of},
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
        Ok(self.add_job_with_assets(&mut job.clone(), &[]).await?.0)
    }

    /// Writes the records of files, as [`Self::add_assets`], and a new job on them: all of it or nothing. Where another record of a file
    /// stands, the job gets that one's id. Gives the records and whether each is new, too.
    ///
    /// # Errors
    /// When the database fails. All of it may be there all the same.
    pub async fn add_job_with_assets(
        &self,
        job: &mut JobRecord,
        assets: &[AssetRecord],
    ) -> Result<(Added, Vec<(AssetRecord, bool)>), StoreError> {
        let mut transaction = self.begin().await?;
        let kept = assets::insert(&mut transaction, assets).await?;
        for input in job.request.inputs.values_mut() {
            let kept = assets.iter().zip(&kept).find(|(asset, _)| asset.id == input.asset);
            if let Some((_, (kept, _))) = kept {
                input.asset = kept.id.clone();
            }
        }
        let added = self.insert_one(&mut transaction, job).await?;
        if added == Added::New {
            self.commit(transaction).await?;
        }
        Ok((added, kept))
    }

    /// Writes a new job; part of a transaction, which is to be given up when the job is not new.
    async fn insert_one(
        &self,
        transaction: &mut Transaction<'static, Any>,
        job: &JobRecord,
    ) -> Result<Added, StoreError> {
        let jobs = std::slice::from_ref(job);
        if insert(transaction, jobs).await? == 0 {
            let key = job.idempotency.as_ref().map(|word| &word.key);
            let query =
                ours(format!("SELECT {COLUMNS} FROM jobs WHERE id = $1 OR (principal = $2 AND idempotency_key = $3)"));
            let query = sqlx::query(query).bind(job.id.as_str()).bind(job.principal.as_str()).bind(key);
            return Ok(Added::Before(Box::new(read(&query.fetch_one(&mut **transaction).await?)?)));
        }
        let is_whole = self.insert_what_belongs_to(transaction, &job.principal, jobs).await?;
        Ok(if is_whole { Added::New } else { Added::FileMissing })
    }

    /// Writes what goes with new jobs of one owner. Gives `false` where a file of one that waits is not there, so that the transaction
    /// is to be given up.
    pub(super) async fn insert_what_belongs_to(
        &self,
        transaction: &mut Transaction<'static, Any>,
        owner: &Principal,
        jobs: &[JobRecord],
    ) -> Result<bool, StoreError> {
        // One file may be both source and target. In the order of the files, in which whoever locks several does so.
        let inputs: BTreeSet<(&str, &str)> = jobs
            .iter()
            .filter(|job| job.state == JobState::Queued)
            .flat_map(|job| job.request.inputs.values().map(|input| (input.asset.as_str(), job.id.as_str())))
            .collect();
        let inputs: Vec<(&str, &str)> = inputs.into_iter().collect();
        for inputs in inputs.chunks(CHUNK) {
            let query = ours(format!(
                "INSERT INTO job_inputs (job_id, asset_id) SELECT named.column1, assets.id FROM (VALUES {}) AS named \
                 JOIN assets ON assets.id = named.column2 AND principal = ${} ORDER BY assets.id {}",
                rows_of(inputs.len(), 2),
                inputs.len() * 2 + 1,
                self.dialect.keep_files()
            ));
            let query = inputs.iter().fold(sqlx::query(query), |query, (asset, job)| query.bind(*job).bind(*asset));
            let found = query.bind(owner.as_str()).execute(&mut **transaction).await?.rows_affected();
            if found < inputs.len() as u64 {
                return Ok(false);
            }
        }
        job_lists::insert_labels(transaction, jobs).await?;
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
                .bind(job.kind().name())
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
