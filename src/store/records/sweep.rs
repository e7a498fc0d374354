//! Removing what has expired.

use jiff::{SignedDuration, Timestamp};

use super::{Records, database::ours};
use crate::store::StoreError;

/// Files that no unfinished job needs. The inputs of an unfinished job stay whatever their age.
const ASSETS: &str = "DELETE FROM assets WHERE expires_at <= $1 AND NOT EXISTS \
                      (SELECT 1 FROM job_inputs JOIN jobs ON jobs.id = job_id \
                       WHERE asset_id = assets.id AND state IN ('queued', 'running', 'canceling')) RETURNING sha256";
const RESULTS: &str = "DELETE FROM results WHERE expires_at <= $1 RETURNING sha256";
const RESULTS_OF_JOBS: &str =
    "DELETE FROM results WHERE job_id IN (SELECT id FROM jobs WHERE expires_at <= $1) RETURNING sha256";
const JOBS: &str = "DELETE FROM jobs WHERE expires_at <= $1 RETURNING ''";
/// A batch goes with the last of its jobs.
const BATCHES: &str = "DELETE FROM batches WHERE NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id)";
/// Old versions of documents that no job can name any more: those that were asked for while a version was current are gone. A job
/// looks documents up a moment before its record is written, hence the hour.
const DOCUMENTS: &str = "DELETE FROM named_documents WHERE superseded_at + 3600000 <= $1 \
                         AND NOT EXISTS (SELECT 1 FROM jobs WHERE created_at <= superseded_at + 3600000)";
const QUARANTINE: &str = "DELETE FROM quarantine WHERE expires_at <= $1";
const TURNS: &str = "DELETE FROM turns WHERE seen_at <= $1 AND NOT EXISTS (SELECT 1 FROM jobs \
                     WHERE jobs.principal = turns.principal AND state IN ('queued', 'running', 'canceling'))";
/// How long the turn of a caller who has not been seen is remembered.
const TURN_RETENTION: SignedDuration = SignedDuration::from_hours(24);

impl Records {
    /// Removes every record that has expired by `now`. Gives how many, and the digests that they had.
    pub(in crate::store) async fn remove_expired(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        // A job that is about to name a file keeps its row, so this waits for it, and the next statement sees the job.
        let query =
            ours(format!("SELECT id FROM assets WHERE expires_at <= $1 ORDER BY id {}", self.dialect.lock_rows()));
        sqlx::query(query).bind(now.as_millisecond()).fetch_all(&mut *transaction).await?;
        let mut removed = Vec::new();
        for query in [ASSETS, RESULTS, RESULTS_OF_JOBS, JOBS] {
            let query = sqlx::query_scalar::<_, String>(query).bind(now.as_millisecond());
            removed.extend(query.fetch_all(&mut *transaction).await?);
        }
        sqlx::query(BATCHES).execute(&mut *transaction).await?;
        let turns = now.checked_sub(TURN_RETENTION).unwrap_or(Timestamp::MIN);
        for (query, before) in [(DOCUMENTS, now), (QUARANTINE, now), (TURNS, turns)] {
            sqlx::query(query).bind(before.as_millisecond()).execute(&mut *transaction).await?;
        }
        self.commit(transaction).await?;
        let count = removed.len() as u64;
        removed.retain(|digest| !digest.is_empty());
        Ok((count, removed))
    }
}
