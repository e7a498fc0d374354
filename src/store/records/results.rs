//! Records of the files that jobs gave.

use std::collections::BTreeMap;

use sqlx::{Any, Row, Transaction, any::AnyRow};

use super::{
    Records, ResultRecord, count,
    database::{CHUNK, ours, places},
    read_id, signed, time, without_nul,
};
use crate::store::{JobId, Principal, ResultId, StoreError};

fn read(row: &AnyRow) -> Result<ResultRecord, StoreError> {
    Ok(ResultRecord {
        id: read_id(row, "id", ResultId::parse)?,
        job_id: read_id(row, "job_id", JobId::parse)?,
        format: row.try_get("format")?,
        file_name: row.try_get("file_name")?,
        sha256: row.try_get("sha256")?,
        bytes: count(row, "bytes")?,
        created_at: time(row, "created_at")?,
        expires_at: time(row, "expires_at")?,
    })
}

/// Writes one; part of the transaction that ends its job.
pub(super) async fn insert(
    transaction: &mut Transaction<'static, Any>,
    result: &ResultRecord,
    position: usize,
) -> Result<(), StoreError> {
    let query = "INSERT INTO results (id, job_id, position, format, file_name, sha256, bytes, created_at, expires_at) \
                 VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9)";
    sqlx::query(query)
        .bind(result.id.as_str())
        .bind(result.job_id.as_str())
        .bind(signed(position as u64))
        .bind(&result.format)
        .bind(without_nul(&result.file_name))
        .bind(&result.sha256)
        .bind(signed(result.bytes))
        .bind(result.created_at.as_millisecond())
        .bind(result.expires_at.as_millisecond())
        .execute(&mut **transaction)
        .await?;
    Ok(())
}

impl Records {
    /// A result; to who does not own its job, there is none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn result(&self, owner: &Principal, id: &ResultId) -> Result<Option<ResultRecord>, StoreError> {
        let query =
            "SELECT results.* FROM results JOIN jobs ON jobs.id = job_id WHERE results.id = $1 AND principal = $2";
        self.optional(sqlx::query(query).bind(id.as_str()).bind(owner.as_str())).await?.as_ref().map(read).transpose()
    }

    /// The results of jobs by the job, each job's in the order asked for.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn results_of(&self, jobs: &[&JobId]) -> Result<BTreeMap<JobId, Vec<ResultRecord>>, StoreError> {
        let mut found: BTreeMap<JobId, Vec<ResultRecord>> = BTreeMap::new();
        for jobs in jobs.chunks(CHUNK) {
            let places = places(1, jobs.len());
            let query = ours(format!("SELECT * FROM results WHERE job_id IN ({places}) ORDER BY job_id, position"));
            for row in self.all(jobs.iter().fold(sqlx::query(query), |query, job| query.bind(job.as_str()))).await? {
                let result = read(&row)?;
                found.entry(result.job_id.clone()).or_default().push(result);
            }
        }
        Ok(found)
    }

    /// The results of a job, in the order asked for.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn job_results(&self, id: &JobId) -> Result<Vec<ResultRecord>, StoreError> {
        let query = sqlx::query("SELECT * FROM results WHERE job_id = $1 ORDER BY position").bind(id.as_str());
        self.all(query).await?.iter().map(read).collect()
    }
}
