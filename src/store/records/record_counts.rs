//! What records take up, and who of them goes first where that is too much.

use sqlx::{Row, any::AnyRow};

use super::{Records, count, signed};
use crate::store::{Principal, StoreError};

/// What the records of one principal, or of all, take up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecordCounts {
    /// Jobs, whatever their state.
    pub jobs: u64,
    /// Versions of rig templates and presets.
    pub documents: u64,
    /// Bytes of all their texts.
    pub bytes: u64,
}

fn read(row: &AnyRow) -> Result<RecordCounts, StoreError> {
    Ok(RecordCounts { jobs: count(row, "jobs")?, documents: count(row, "documents")?, bytes: count(row, "bytes")? })
}

impl Records {
    /// What one principal has.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn record_counts(&self, owner: &Principal) -> Result<RecordCounts, StoreError> {
        let query = sqlx::query("SELECT jobs, documents, bytes FROM record_counts WHERE principal = $1");
        self.optional(query.bind(owner.as_str())).await?.as_ref().map_or_else(|| Ok(RecordCounts::default()), read)
    }

    /// What all have together.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn all_record_counts(&self) -> Result<RecordCounts, StoreError> {
        let query = "SELECT CAST(COALESCE(SUM(jobs), 0) AS BIGINT) AS jobs, \
                     CAST(COALESCE(SUM(documents), 0) AS BIGINT) AS documents, \
                     CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes FROM record_counts";
        read(&self.one(sqlx::query(query)).await?)
    }

    /// Removes up to `most` jobs that have ended, those that ended first, of one principal or of all. Gives how many there were, and the
    /// digests of their blobs.
    ///
    /// # Errors
    /// When the database fails. They may be gone all the same.
    pub(in crate::store) async fn remove_oldest_ended(
        &self,
        owner: Option<&Principal>,
        most: u64,
    ) -> Result<(u64, Vec<String>), StoreError> {
        let mut transaction = self.begin().await?;
        let query = match owner {
            Some(owner) => sqlx::query(
                "SELECT id FROM jobs WHERE principal = $1 AND finished_at IS NOT NULL ORDER BY finished_at LIMIT $2",
            )
            .bind(owner.as_str())
            .bind(signed(most)),
            // By the time at which they expire, which is the same order and has an index.
            None => sqlx::query("SELECT id FROM jobs WHERE expires_at IS NOT NULL ORDER BY expires_at LIMIT $1")
                .bind(signed(most)),
        };
        let rows = query.fetch_all(&mut *transaction).await?;
        let ids = rows.iter().map(|row| row.try_get("id")).collect::<Result<Vec<String>, _>>()?;
        let digests = self.remove_jobs(&mut transaction, &ids).await?;
        self.commit(transaction).await?;
        Ok((ids.len() as u64, digests))
    }
}
