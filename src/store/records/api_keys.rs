//! Records of the keys with which callers say who they are.

use jiff::Timestamp;
use sqlx::{Row, any::AnyRow};

use super::{Records, optional_time, principal, read_id, time};
use crate::store::{ApiKeyId, Principal, StoreError};

named! {
    /// What a key allows.
    #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
    pub enum Scope {
        /// To look at one's own files, jobs, results, rigs and presets.
        Read = "read",
        /// To upload, to ask for jobs, and to change and remove what is one's own.
        Write = "write",
        /// To make, list and revoke keys, for everybody.
        Admin = "admin",
    }
}

/// A key, without its secret: that is known to its holder alone.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ApiKeyRecord {
    /// Its name, which is no secret.
    pub id: ApiKeyId,
    /// Who has it.
    pub principal: Principal,
    /// SHA-256 of the secret, in hexadecimal. The secret has 256 random bits, so nobody finds it by trying.
    pub sha256: String,
    /// What it allows, each once, in the order of [`Scope::ALL`].
    pub scopes: Vec<Scope>,
    /// When it was made.
    pub created_at: Timestamp,
    /// When it ends; never, where there is none.
    pub expires_at: Option<Timestamp>,
    /// When it was last shown, to within some minutes; never, where there is none.
    pub last_used_at: Option<Timestamp>,
    /// What it was made for, in the words of whoever made it.
    pub note: String,
    /// When it was revoked; it opens nothing since then.
    pub revoked_at: Option<Timestamp>,
}

fn read(row: &AnyRow) -> Result<ApiKeyRecord, StoreError> {
    let scopes: String = row.try_get("scopes")?;
    Ok(ApiKeyRecord {
        id: read_id(row, "id", ApiKeyId::parse)?,
        principal: principal(row)?,
        sha256: row.try_get("sha256")?,
        scopes: scopes.split(' ').filter_map(Scope::from_name).collect(),
        created_at: time(row, "created_at")?,
        expires_at: optional_time(row, "expires_at")?,
        last_used_at: optional_time(row, "last_used_at")?,
        note: row.try_get("note")?,
        revoked_at: optional_time(row, "revoked_at")?,
    })
}

/// Keys of one principal that are listed. Of more, those that open nothing any more go, the oldest first, when another is made.
const MAX_LISTED: i64 = 50;

impl Records {
    /// Writes a key. Gives `false`, and writes nothing, when its principal has `most` keys already that have not ended by the time
    /// this one is made.
    ///
    /// # Errors
    /// When the database fails. The key may have been written all the same.
    pub async fn add_api_key(&self, key: &ApiKeyRecord, most: u64) -> Result<bool, StoreError> {
        /// Keys are made one after the other: each looks at what is there before it is written.
        const LOCK: &str = "api_keys";
        let mut transaction = self.begin().await?;
        self.lock(&mut transaction, LOCK, super::database::Lock::Alone).await?;
        let query = "SELECT COUNT(*) FROM api_keys \
                     WHERE principal = $1 AND revoked_at IS NULL AND (expires_at IS NULL OR expires_at > $2)";
        let kept: i64 = sqlx::query_scalar(query)
            .bind(key.principal.as_str())
            .bind(key.created_at.as_millisecond())
            .fetch_one(&mut *transaction)
            .await?;
        if u64::try_from(kept).unwrap_or(0) >= most {
            return Ok(false);
        }
        let query = "DELETE FROM api_keys WHERE principal = $1 AND (revoked_at IS NOT NULL OR expires_at <= $2) \
                     AND id NOT IN (SELECT id FROM api_keys WHERE principal = $1 ORDER BY id DESC LIMIT $3)";
        sqlx::query(query)
            .bind(key.principal.as_str())
            .bind(key.created_at.as_millisecond())
            .bind(MAX_LISTED - 1)
            .execute(&mut *transaction)
            .await?;
        let query = "INSERT INTO api_keys (id, principal, sha256, scopes, created_at, expires_at, note) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7)";
        sqlx::query(query)
            .bind(key.id.as_str())
            .bind(key.principal.as_str())
            .bind(&key.sha256)
            .bind(key.scopes.iter().map(|scope| scope.name()).collect::<Vec<_>>().join(" "))
            .bind(key.created_at.as_millisecond())
            .bind(key.expires_at.map(Timestamp::as_millisecond))
            .bind(&key.note)
            .execute(&mut *transaction)
            .await?;
        self.commit(transaction).await?;
        Ok(true)
    }

    /// A key that was not revoked.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn api_key(&self, id: &ApiKeyId) -> Result<Option<ApiKeyRecord>, StoreError> {
        let query = sqlx::query("SELECT * FROM api_keys WHERE id = $1 AND revoked_at IS NULL").bind(id.as_str());
        self.optional(query).await?.as_ref().map(read).transpose()
    }

    /// Notes that a key was shown.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn note_use_of_api_key(&self, id: &ApiKeyId, now: Timestamp) -> Result<(), StoreError> {
        let query = "UPDATE api_keys SET last_used_at = $2 WHERE id = $1";
        self.execute(sqlx::query(query).bind(id.as_str()).bind(now.as_millisecond())).await?;
        Ok(())
    }

    /// All keys, revoked ones too, the oldest first. There are a few for each principal, and principals are added by hand.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn api_keys(&self) -> Result<Vec<ApiKeyRecord>, StoreError> {
        self.all(sqlx::query("SELECT * FROM api_keys ORDER BY id")).await?.iter().map(read).collect()
    }

    /// Revokes a key, which stays in the list. Gives whether it was there and not revoked before.
    ///
    /// # Errors
    /// When the database fails. The key may be revoked all the same.
    pub async fn revoke_api_key(&self, id: &ApiKeyId, now: Timestamp) -> Result<bool, StoreError> {
        let query = "UPDATE api_keys SET revoked_at = $2 WHERE id = $1 AND revoked_at IS NULL";
        let done = self.execute(sqlx::query(query).bind(id.as_str()).bind(now.as_millisecond())).await?;
        Ok(done.rows_affected() > 0)
    }
}
