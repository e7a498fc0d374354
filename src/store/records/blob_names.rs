//! What the records know of blobs.

use sqlx::Row;

use super::{
    Records,
    database::{CHUNK, ours, rows_of},
};
use crate::store::StoreError;

impl Records {
    /// Whether any record names that blob.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn names_blob(&self, sha256: &str) -> Result<bool, StoreError> {
        // The first of many is enough.
        let query = "SELECT CAST(CASE WHEN EXISTS (SELECT 1 FROM assets WHERE sha256 = $1) \
                     OR EXISTS (SELECT 1 FROM results WHERE sha256 = $1) THEN 1 ELSE 0 END AS BIGINT) AS named";
        Ok(self.one(sqlx::query(query).bind(sha256)).await?.try_get::<i64, _>("named")? > 0)
    }

    /// Those of these digests that no record names.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn unnamed_blobs(&self, digests: &[String]) -> Result<Vec<String>, StoreError> {
        let mut unnamed = Vec::new();
        for digests in digests.chunks(CHUNK) {
            let query = ours(format!(
                "SELECT column1 AS sha256 FROM (VALUES {}) AS digests WHERE NOT EXISTS (SELECT 1 FROM assets WHERE sha256 = column1) \
                 AND NOT EXISTS (SELECT 1 FROM results WHERE sha256 = column1)",
                rows_of(digests.len(), 1)
            ));
            for row in self.all(digests.iter().fold(sqlx::query(query), |query, digest| query.bind(digest))).await? {
                unnamed.push(row.try_get::<String, _>("sha256")?);
            }
        }
        Ok(unnamed)
    }

    /// Bytes of all blobs that records name, each counted once. Takes as long as there are many, and no memory: both indices have the digests
    /// in their order.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn stored_bytes(&self) -> Result<u64, StoreError> {
        let query = "SELECT CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes FROM (\
                     SELECT MAX(bytes) AS bytes FROM assets GROUP BY sha256 UNION ALL \
                     SELECT MAX(bytes) AS bytes FROM results WHERE NOT EXISTS \
                     (SELECT 1 FROM assets WHERE assets.sha256 = results.sha256) GROUP BY sha256) AS blobs";
        super::count(&self.one(sqlx::query(query)).await?, "bytes")
    }
}
