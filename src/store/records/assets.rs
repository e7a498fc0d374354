//! Records of uploaded files.

use jiff::Timestamp;
use sqlx::{Row, sqlite::SqliteRow};

use super::{AssetRecord, Page, Records, count, read_id, signed, time};
use crate::store::{AssetId, JobId, StoreError};

fn read(row: &SqliteRow) -> Result<AssetRecord, StoreError> {
    Ok(AssetRecord {
        id: read_id(row, "id", AssetId::parse)?,
        sha256: row.try_get("sha256")?,
        bytes: count(row, "bytes")?,
        format: row.try_get("format")?,
        file_name: row.try_get("file_name")?,
        created_at: time(row, "created_at")?,
        expires_at: time(row, "expires_at")?,
    })
}

impl Records {
    /// Writes a file's record. Where the same bytes of the same format are known already, that record stands and is kept
    /// at least as long. Gives the record and whether it is new.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn add_asset(&self, asset: &AssetRecord) -> Result<(AssetRecord, bool), StoreError> {
        let mut transaction = self.begin().await?;
        let query = "INSERT INTO assets (id, sha256, bytes, format, file_name, created_at, expires_at) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7) \
                     ON CONFLICT (sha256, format) DO UPDATE SET expires_at = MAX(expires_at, excluded.expires_at) \
                     RETURNING *";
        let row = sqlx::query(query)
            .bind(asset.id.as_str())
            .bind(&asset.sha256)
            .bind(signed(asset.bytes))
            .bind(&asset.format)
            .bind(&asset.file_name)
            .bind(asset.created_at.as_millisecond())
            .bind(asset.expires_at.as_millisecond())
            .fetch_one(&mut *transaction)
            .await?;
        transaction.commit().await?;
        let stored = read(&row)?;
        let is_new = stored.id == asset.id;
        Ok((stored, is_new))
    }

    /// A file's record.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn asset(&self, id: &AssetId) -> Result<Option<AssetRecord>, StoreError> {
        let row =
            sqlx::query("SELECT * FROM assets WHERE id = $1").bind(id.as_str()).fetch_optional(&self.pool).await?;
        row.as_ref().map(read).transpose()
    }

    /// Up to `most` records, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn assets(&self, before: Option<&AssetId>, most: usize) -> Result<Page<AssetRecord>, StoreError> {
        let query = "SELECT * FROM assets WHERE $1 IS NULL OR id < $1 ORDER BY id DESC LIMIT $2";
        let rows = sqlx::query(query)
            .bind(before.map(AssetId::as_str))
            .bind(signed(most as u64 + 1))
            .fetch_all(&self.pool)
            .await?;
        Ok(Page::cut(rows.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// Removes a file's record and gives it back; `None` when there is none.
    ///
    /// # Errors
    /// [`StoreError::InUse`] when an unfinished job needs the file.
    pub async fn remove_asset(&self, id: &AssetId) -> Result<Option<AssetRecord>, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "SELECT id FROM jobs JOIN job_inputs ON job_id = id WHERE asset_id = $1 \
                     AND state IN ('queued', 'running', 'canceling') LIMIT 1";
        if let Some(row) = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut *transaction).await? {
            return Err(StoreError::InUse(read_id(&row, "id", JobId::parse)?));
        }
        let query = "DELETE FROM assets WHERE id = $1 RETURNING *";
        let row = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut *transaction).await?;
        transaction.commit().await?;
        row.as_ref().map(read).transpose()
    }

    /// Keeps a file at least until `expires_at`. Gives whether it is there.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn keep_asset(&self, id: &AssetId, expires_at: Timestamp) -> Result<bool, StoreError> {
        let mut transaction = self.begin().await?;
        let query = "UPDATE assets SET expires_at = MAX(expires_at, $2) WHERE id = $1";
        let done =
            sqlx::query(query).bind(id.as_str()).bind(expires_at.as_millisecond()).execute(&mut *transaction).await?;
        transaction.commit().await?;
        Ok(done.rows_affected() > 0)
    }
}
