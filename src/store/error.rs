//! Why the store did not do what it was asked to.

/// Why the store did not do what it was asked to.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The database.
    #[error("the database failed: {0}")]
    Database(#[from] sqlx::Error),
    /// The database's layout could not be brought up to date.
    #[error("the database could not be brought up to date: {0}")]
    Migration(#[from] sqlx::migrate::MigrateError),
    /// The blob store.
    #[error("the file store failed: {0}")]
    Blobs(#[from] object_store::Error),
    /// A record holds what this version cannot read.
    #[error("the record '{record}' cannot be read: {reason}")]
    Unreadable {
        /// Which record.
        record: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A job is waiting for the file or working on it.
    #[error("the file is an input of the unfinished job {0}")]
    InUse(super::JobId),
    /// The data folder.
    #[error("the data folder {folder} cannot be used: {reason}")]
    Folder {
        /// Which folder.
        folder: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Another server writes to the data folder.
    #[error("another server is using the data folder {0}; stop it, or give this one a folder of its own with --data")]
    Locked(String),
}

impl StoreError {
    /// Whether the disk is full.
    #[must_use]
    pub fn is_storage_full(&self) -> bool {
        let Self::Blobs(error) = self else { return false };
        let mut source: Option<&(dyn std::error::Error + 'static)> = Some(error);
        while let Some(error) = source {
            if let Some(error) = error.downcast_ref::<std::io::Error>() {
                return matches!(error.kind(), std::io::ErrorKind::StorageFull | std::io::ErrorKind::QuotaExceeded);
            }
            source = error.source();
        }
        false
    }
}
