//! What the records know of blobs.

use std::collections::BTreeSet;

use sqlx::Row;

use super::{
    Records,
    database::{CHUNK, ours, places},
};
use crate::store::StoreError;

impl Records {
    /// Whether any record names that blob.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn names_blob(&self, sha256: &str) -> Result<bool, StoreError> {
        let query = "SELECT CAST(COUNT(*) AS BIGINT) AS named FROM \
                     (SELECT 1 FROM assets WHERE sha256 = $1 UNION ALL SELECT 1 FROM results WHERE sha256 = $1) AS names";
        Ok(self.one(sqlx::query(query).bind(sha256)).await?.try_get::<i64, _>("named")? > 0)
    }

    /// Those of these digests that no record names.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn unnamed_blobs(&self, digests: &[String]) -> Result<Vec<String>, StoreError> {
        let mut named = BTreeSet::new();
        for digests in digests.chunks(CHUNK) {
            let places = places(1, digests.len());
            let query = ours(format!(
                "SELECT sha256 FROM assets WHERE sha256 IN ({places}) UNION SELECT sha256 FROM results WHERE sha256 IN ({places})"
            ));
            for row in self.all(digests.iter().fold(sqlx::query(query), |query, digest| query.bind(digest))).await? {
                named.insert(row.try_get::<String, _>("sha256")?);
            }
        }
        Ok(digests.iter().filter(|digest| !named.contains(*digest)).cloned().collect())
    }

    /// Bytes of all blobs that records name, each counted once.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn stored_bytes(&self) -> Result<u64, StoreError> {
        let query = "SELECT CAST(COALESCE(SUM(bytes), 0) AS BIGINT) AS bytes FROM \
                     (SELECT sha256, bytes FROM assets UNION SELECT sha256, bytes FROM results) AS blobs";
        super::count(&self.one(sqlx::query(query)).await?, "bytes")
    }
}
