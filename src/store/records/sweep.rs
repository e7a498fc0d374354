//! Removing what has expired, some of it at a time: each step is a transaction of its own, for which others wait no longer than a moment.

use std::collections::BTreeSet;

use jiff::{SignedDuration, Timestamp};
use sqlx::{Any, Row as _, Transaction};

use super::{
    Dialect, Records,
    database::{ours, places},
    signed,
};
use crate::store::StoreError;

/// Rows that one step removes: others wait for it to write.
pub(super) const STEP: usize = 100;

/// Old versions of documents that no job can name any more: those that were asked for while a version was current are gone. A job
/// looks documents up a moment before its record is written, hence the hour.
const DOCUMENTS: &str = "SELECT principal, kind, name, version FROM named_documents AS old \
                         WHERE superseded_at <= $1 - 3600000 AND superseded_at IS NOT NULL AND COALESCE((SELECT MIN(created_at) \
                         FROM jobs WHERE jobs.principal = old.principal), $1) > superseded_at + 3600000 ORDER BY superseded_at LIMIT $2";
const QUARANTINE: &str = "DELETE FROM quarantine WHERE expires_at <= $1";
const TURNS: &str = "DELETE FROM turns WHERE seen_at <= $1 AND NOT EXISTS (SELECT 1 FROM jobs \
                     WHERE jobs.principal = turns.principal AND state IN ('queued', 'running', 'canceling'))";
/// How long the turn of a caller who has not been seen is remembered.
const TURN_RETENTION: SignedDuration = SignedDuration::from_hours(24);
/// Pages of the file that are given back at once.
const PAGES: &str = "PRAGMA incremental_vacuum(256)";
/// How often one sweep does so: 16 MiB.
const MAX_PAGE_STEPS: usize = 16;

impl Records {
    /// Removes some of the records that have expired by `now`. Gives how many, and the digests that they had; where that is none, nothing is
    /// left.
    pub(in crate::store) async fn remove_expired(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let (mut removed, mut digests) = (0, Vec::new());
        for (count, found) in [
            self.remove_expired_assets(now).await?,
            self.remove_expired_results(now).await?,
            self.remove_expired_jobs(now).await?,
        ] {
            removed += count;
            digests.extend(found);
        }
        Ok((removed, digests))
    }

    /// Removes what is left behind when jobs are gone, and gives the room that is free back to the disk.
    pub(in crate::store) async fn tidy(&self, now: Timestamp) -> Result<(), StoreError> {
        let turns = now.checked_sub(TURN_RETENTION).unwrap_or(Timestamp::MIN);
        self.remove_old_documents(now).await?;
        for (query, before) in [(QUARANTINE, now), (TURNS, turns)] {
            self.execute(sqlx::query(query).bind(before.as_millisecond())).await?;
        }
        if self.dialect == Dialect::Sqlite {
            for _ in 0..MAX_PAGE_STEPS {
                self.give_pages_back(PAGES).await?;
            }
        }
        Ok(())
    }

    /// Files that no unfinished job needs. The inputs of an unfinished job stay whatever their age.
    async fn remove_expired_assets(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        // Only unfinished jobs are there.
        let is_free = "NOT EXISTS (SELECT 1 FROM job_inputs WHERE asset_id = assets.id)";
        let query =
            ours(format!("SELECT id FROM assets WHERE expires_at <= $1 AND {is_free} ORDER BY expires_at LIMIT $2"));
        let query = sqlx::query_scalar::<_, String>(query).bind(now.as_millisecond()).bind(signed(STEP as u64));
        let ids = query.fetch_all(&mut *transaction).await?;
        // A job that is about to name a file keeps its row, so this waits for it, and the next statement sees the job.
        let lock = self.dialect.lock_rows();
        let query = format!("SELECT id FROM assets WHERE id IN ({}) ORDER BY id {lock}", places(1, ids.len()));
        let ids = returned(&mut transaction, query, &ids).await?;
        let query = format!("DELETE FROM assets WHERE {is_free} AND id IN ({}) RETURNING sha256", places(1, ids.len()));
        let digests = returned(&mut transaction, query, &ids).await?;
        self.commit(transaction).await?;
        Ok((digests.len() as u64, digests))
    }

    async fn remove_expired_results(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        let query = "SELECT id FROM results WHERE expires_at <= $1 ORDER BY expires_at LIMIT $2";
        let query = sqlx::query_scalar::<_, String>(query).bind(now.as_millisecond()).bind(signed(STEP as u64));
        let ids = query.fetch_all(&mut *transaction).await?;
        let query = format!("DELETE FROM results WHERE id IN ({}) RETURNING sha256", places(1, ids.len()));
        let digests = returned(&mut transaction, query, &ids).await?;
        self.commit(transaction).await?;
        Ok((digests.len() as u64, digests))
    }

    async fn remove_old_documents(&self, now: Timestamp) -> Result<(), StoreError> {
        let mut transaction = self.begin().await?;
        let query = sqlx::query(DOCUMENTS).bind(now.as_millisecond()).bind(signed(STEP as u64));
        for row in query.fetch_all(&mut *transaction).await? {
            let query = "DELETE FROM named_documents WHERE principal = $1 AND kind = $2 AND name = $3 AND version = $4";
            let mut query = sqlx::query(query);
            for column in ["principal", "kind", "name"] {
                query = query.bind(row.try_get::<String, _>(column)?);
            }
            query.bind(row.try_get::<i64, _>("version")?).execute(&mut *transaction).await?;
        }
        self.commit(transaction).await
    }

    async fn remove_expired_jobs(&self, now: Timestamp) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        let query = "SELECT id FROM jobs WHERE expires_at <= $1 ORDER BY expires_at LIMIT $2";
        let query = sqlx::query_scalar::<_, String>(query).bind(now.as_millisecond()).bind(signed(STEP as u64));
        let ids = query.fetch_all(&mut *transaction).await?;
        let digests = self.remove_jobs(&mut transaction, &ids).await?;
        self.commit(transaction).await?;
        Ok((ids.len() as u64, digests))
    }

    /// Removes jobs that have ended, with their results; part of a transaction. Gives the digests of their blobs.
    pub(super) async fn remove_jobs(
        &self,
        transaction: &mut Transaction<'static, Any>,
        ids: &[String],
    ) -> Result<Vec<String>, StoreError> {
        let mut digests = Vec::new();
        for ids in ids.chunks(STEP) {
            let query = format!("DELETE FROM results WHERE job_id IN ({}) RETURNING sha256", places(1, ids.len()));
            digests.extend(returned(transaction, query, ids).await?);
            let query =
                format!("DELETE FROM jobs WHERE id IN ({}) RETURNING COALESCE(batch_id, '')", places(1, ids.len()));
            let batches: BTreeSet<String> = returned(transaction, query, ids).await?.into_iter().collect();
            let batches: Vec<String> = batches.into_iter().filter(|batch| !batch.is_empty()).collect();
            // A batch goes with the last of its jobs. Who removes another of them at the same time is waited for, and sees it then.
            let query = format!(
                "SELECT id FROM batches WHERE id IN ({}) ORDER BY id {}",
                places(1, batches.len()),
                self.dialect.lock_rows()
            );
            returned(transaction, query, &batches).await?;
            let query = format!(
                "DELETE FROM batches WHERE id IN ({}) AND NOT EXISTS (SELECT 1 FROM jobs WHERE batch_id = batches.id) RETURNING id",
                places(1, batches.len())
            );
            returned(transaction, query, &batches).await?;
        }
        Ok(digests)
    }
}

/// What a statement returns that is about these ids; nothing where there are none.
pub(super) async fn returned(
    transaction: &mut Transaction<'static, Any>,
    query: String,
    ids: &[String],
) -> Result<Vec<String>, StoreError> {
    if ids.is_empty() {
        return Ok(Vec::new());
    }
    let query = ids.iter().fold(sqlx::query_scalar::<_, String>(ours(query)), |query, id| query.bind(id));
    Ok(query.fetch_all(&mut **transaction).await?)
}
