//! Removing what has expired.

use jiff::Timestamp;

use super::Records;
use crate::store::StoreError;

/// Files that no unfinished job needs. The inputs of an unfinished job stay whatever their age.
const ASSETS: &str = "DELETE FROM assets WHERE expires_at <= $1 AND id NOT IN \
                      (SELECT asset_id FROM job_inputs JOIN jobs ON jobs.id = job_id \
                       WHERE state IN ('queued', 'running', 'canceling')) RETURNING sha256";
const RESULTS: &str = "DELETE FROM results WHERE expires_at <= $1 RETURNING sha256";
const RESULTS_OF_JOBS: &str =
    "DELETE FROM results WHERE job_id IN (SELECT id FROM jobs WHERE expires_at <= $1) RETURNING sha256";
const JOBS: &str = "DELETE FROM jobs WHERE expires_at <= $1 RETURNING ''";
/// Old versions of documents that no job can name any more: those that were asked for while a version was current are gone. A job
/// looks documents up a moment before its record is written, hence the hour.
const DOCUMENTS: &str = "DELETE FROM named_documents WHERE superseded_at + 3600000 <= $1 \
                         AND NOT EXISTS (SELECT 1 FROM jobs WHERE created_at <= superseded_at + 3600000)";

impl Records {
    /// Removes every record that has expired by `now`. Gives how many, and the digests that they had.
    pub(in crate::store) async fn remove_expired(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        let mut removed = Vec::new();
        for query in [ASSETS, RESULTS, RESULTS_OF_JOBS, JOBS] {
            let query = sqlx::query_scalar::<_, String>(query).bind(now.as_millisecond());
            removed.extend(query.fetch_all(&mut *transaction).await?);
        }
        sqlx::query(DOCUMENTS).bind(now.as_millisecond()).execute(&mut *transaction).await?;
        transaction.commit().await?;
        let count = removed.len() as u64;
        removed.retain(|digest| !digest.is_empty());
        Ok((count, removed))
    }
}
