//! Opening the database and bringing its layout up to date.

use std::{borrow::Cow, path::Path, time::Duration};

use sqlx::{
    ConnectOptions as _, SqlStr, Sqlite, SqlitePool, Transaction,
    migrate::{Migration, MigrationType, Migrator},
    sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous},
};

use crate::store::StoreError;

/// Every change of the layout, in order. A released one is never edited; add a new one.
const MIGRATIONS: [(i64, &str, &str); 2] = [
    (1, "first", include_str!("../migrations/0001_first.sql")),
    (2, "named documents", include_str!("../migrations/0002_named_documents.sql")),
];

/// The records of a data folder.
#[derive(Clone, Debug)]
pub struct Records {
    pub(super) pool: SqlitePool,
}

impl Records {
    /// Opens the database file, makes it where it is not there, and brings it up to date.
    ///
    /// # Errors
    /// When the file cannot be opened, or comes from a newer version.
    pub async fn open(file: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(10))
            .foreign_keys(true)
            .disable_statement_logging();
        let pool = SqlitePoolOptions::new().max_connections(8).connect_with(options).await?;
        let migrations: Vec<Migration> = MIGRATIONS
            .into_iter()
            .map(|(version, name, text)| {
                let sql = SqlStr::from_static(text);
                Migration::new(version, Cow::Borrowed(name), MigrationType::Simple, sql, false)
            })
            .collect();
        Migrator { migrations: Cow::Owned(migrations), ..Migrator::DEFAULT }.run(&pool).await?;
        Ok(Self { pool })
    }

    /// A transaction that may write.
    pub(super) async fn begin(&self) -> Result<Transaction<'static, Sqlite>, StoreError> {
        Ok(self.pool.begin_with("BEGIN IMMEDIATE").await?)
    }

    /// Whether the database answers.
    ///
    /// # Errors
    /// When it does not.
    pub async fn check(&self) -> Result<(), StoreError> {
        sqlx::query("SELECT 1").execute(&self.pool).await?;
        Ok(())
    }

    /// Closes the database when everything that uses it has ended.
    pub async fn close(&self) {
        self.pool.close().await;
    }

    /// Whether any record names that blob.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn names_blob(&self, sha256: &str) -> Result<bool, StoreError> {
        let query = "SELECT EXISTS (SELECT 1 FROM assets WHERE sha256 = $1) OR \
                     EXISTS (SELECT 1 FROM results WHERE sha256 = $1)";
        Ok(sqlx::query_scalar::<_, i64>(query).bind(sha256).fetch_one(&self.pool).await? != 0)
    }

    /// Bytes of all blobs that records name, each counted once.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn stored_bytes(&self) -> Result<u64, StoreError> {
        let query = "SELECT COALESCE(SUM(bytes), 0) FROM \
                     (SELECT sha256, bytes FROM assets UNION SELECT sha256, bytes FROM results)";
        let sum = sqlx::query_scalar::<_, i64>(query).fetch_one(&self.pool).await?;
        Ok(u64::try_from(sum).unwrap_or(0))
    }
}
