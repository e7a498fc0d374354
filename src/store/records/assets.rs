//! Records of uploaded files.

use std::collections::BTreeMap;

use sqlx::{Any, Row, Transaction, any::AnyRow};

use super::{
    AssetRecord, Page, Records, count,
    database::{CHUNK, ours, places},
    principal, read_id, signed, time, without_nul,
};
use crate::store::{AssetId, JobId, Principal, StoreError};

fn read(row: &AnyRow) -> Result<AssetRecord, StoreError> {
    Ok(AssetRecord {
        id: read_id(row, "id", AssetId::parse)?,
        principal: principal(row)?,
        sha256: row.try_get("sha256")?,
        bytes: count(row, "bytes")?,
        format: row.try_get("format")?,
        file_name: row.try_get("file_name")?,
        created_at: time(row, "created_at")?,
        expires_at: time(row, "expires_at")?,
    })
}

/// Writes the records of files; part of a transaction. Gives those that stand, and whether each is new.
pub(super) async fn insert(
    transaction: &mut Transaction<'static, Any>,
    assets: &[AssetRecord],
) -> Result<Vec<(AssetRecord, bool)>, StoreError> {
    let query = "INSERT INTO assets (id, sha256, bytes, format, file_name, created_at, expires_at, principal) \
                 VALUES ($1, $2, $3, $4, $5, $6, $7, $8) ON CONFLICT (principal, sha256, format) DO UPDATE SET \
                 file_name = CASE WHEN excluded.file_name <> '' THEN excluded.file_name ELSE assets.file_name END, expires_at = \
                 CASE WHEN assets.expires_at > excluded.expires_at THEN assets.expires_at ELSE excluded.expires_at END \
                 RETURNING *";
    // Two callers with the same files wait for one another, and never for each other.
    let mut order: Vec<usize> = (0..assets.len()).collect();
    order.sort_by_key(|&index| (&assets[index].sha256, &assets[index].format));
    let mut stored: Vec<Option<(AssetRecord, bool)>> = vec![None; assets.len()];
    for index in order {
        let asset = &assets[index];
        let query = sqlx::query(query)
            .bind(asset.id.as_str())
            .bind(&asset.sha256)
            .bind(signed(asset.bytes))
            .bind(&asset.format)
            .bind(without_nul(&asset.file_name))
            .bind(asset.created_at.as_millisecond())
            .bind(asset.expires_at.as_millisecond())
            .bind(asset.principal.as_str());
        let record = read(&query.fetch_one(&mut **transaction).await?)?;
        let is_new = record.id == asset.id;
        stored[index] = Some((record, is_new));
    }
    Ok(stored.into_iter().flatten().collect())
}

impl Records {
    /// Writes a file's record, as [`Self::add_assets`].
    ///
    /// # Errors
    /// When the database fails.
    pub async fn add_asset(&self, asset: &AssetRecord) -> Result<(AssetRecord, bool), StoreError> {
        // One for each.
        Ok(self.add_assets(std::slice::from_ref(asset)).await?.swap_remove(0))
    }

    /// Writes the records of files, all of them or none. Where their owner has the same bytes of the same format already, that record
    /// stands and is kept at least as long. Gives the records and whether each is new.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn add_assets(&self, assets: &[AssetRecord]) -> Result<Vec<(AssetRecord, bool)>, StoreError> {
        let mut transaction = self.begin().await?;
        let stored = insert(&mut transaction, assets).await?;
        self.commit(transaction).await?;
        Ok(stored)
    }

    /// A file's record; to who does not own it, there is none.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn asset(&self, owner: &Principal, id: &AssetId) -> Result<Option<AssetRecord>, StoreError> {
        let query = "SELECT * FROM assets WHERE id = $1 AND principal = $2";
        let row = self.optional(sqlx::query(query).bind(id.as_str()).bind(owner.as_str())).await?;
        row.as_ref().map(read).transpose()
    }

    /// Those of these files that their owner has, by id.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn assets_of(
        &self,
        owner: &Principal,
        ids: &[&AssetId],
    ) -> Result<BTreeMap<AssetId, AssetRecord>, StoreError> {
        let mut found = BTreeMap::new();
        for ids in ids.chunks(CHUNK) {
            let query = ours(format!("SELECT * FROM assets WHERE principal = $1 AND id IN ({})", places(2, ids.len())));
            let query = ids.iter().fold(sqlx::query(query).bind(owner.as_str()), |query, id| query.bind(id.as_str()));
            for row in self.all(query).await? {
                let asset = read(&row)?;
                found.insert(asset.id.clone(), asset);
            }
        }
        Ok(found)
    }

    /// Up to `most` records of one owner, newest first, that are older than `before`.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn assets(
        &self,
        owner: &Principal,
        before: Option<&AssetId>,
        most: usize,
    ) -> Result<Page<AssetRecord>, StoreError> {
        let query = match before {
            Some(_) => "SELECT * FROM assets WHERE principal = $1 AND id < $3 ORDER BY id DESC LIMIT $2",
            None => "SELECT * FROM assets WHERE principal = $1 ORDER BY id DESC LIMIT $2",
        };
        let query = sqlx::query(query).bind(owner.as_str()).bind(signed(most as u64 + 1));
        let query = before.into_iter().fold(query, |query, id| query.bind(id.as_str()));
        let rows = self.all(query).await?;
        Ok(Page::cut(rows.iter().map(read).collect::<Result<_, _>>()?, most))
    }

    /// Removes a file's record and gives it back; `None` when its owner has none.
    ///
    /// # Errors
    /// [`StoreError::InUse`] when an unfinished job needs the file.
    pub async fn remove_asset(&self, owner: &Principal, id: &AssetId) -> Result<Option<AssetRecord>, StoreError> {
        let mut transaction = self.begin().await?;
        // A job that is about to name the file keeps its row, so this waits for it and then sees the job.
        let query =
            ours(format!("SELECT id FROM assets WHERE id = $1 AND principal = $2 {}", self.dialect.lock_rows()));
        let found = sqlx::query(query).bind(id.as_str()).bind(owner.as_str()).fetch_optional(&mut *transaction).await?;
        if found.is_none() {
            return Ok(None);
        }
        // Only unfinished jobs are there.
        let query = "SELECT job_id AS id FROM job_inputs WHERE asset_id = $1 LIMIT 1";
        if let Some(row) = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut *transaction).await? {
            return Err(StoreError::InUse(read_id(&row, "id", JobId::parse)?));
        }
        let query = "DELETE FROM assets WHERE id = $1 RETURNING *";
        let row = sqlx::query(query).bind(id.as_str()).fetch_optional(&mut *transaction).await?;
        self.commit(transaction).await?;
        row.as_ref().map(read).transpose()
    }
}
