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
    /// The URL is of no kind that is known.
    #[error("the URL of the {what} is of no known kind; use {known}")]
    UnknownScheme {
        /// `database` or `blob store`.
        what: &'static str,
        /// What could stand there.
        known: &'static str,
    },
    /// A record holds what this version cannot read.
    #[error("the record '{record}' cannot be read: {reason}")]
    Unreadable {
        /// Which record.
        record: String,
        /// What is wrong with it.
        reason: String,
    },
    /// What is left of the disk is kept for records.
    #[error("the disk of {folder} has only {free_bytes} bytes left, which are kept for records (--reserved-disk)")]
    NoRoom {
        /// Where the files are kept.
        folder: String,
        /// What is left.
        free_bytes: u64,
        /// What is to be left.
        reserved_bytes: u64,
    },
    /// A job is waiting for the file or working on it.
    #[error("the file is an input of the unfinished job {0}")]
    InUse(super::JobId),
    /// The system gives no random bytes.
    #[error("the system gives no random bytes: {0}")]
    Random(#[from] getrandom::Error),
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
    /// Whether the same may work later: the database or the blob store did not answer, or said that it cannot now.
    #[must_use]
    pub fn is_passing(&self) -> bool {
        match self {
            Self::Database(error) => match error {
                sqlx::Error::Io(_) | sqlx::Error::Tls(_) | sqlx::Error::PoolTimedOut | sqlx::Error::WorkerCrashed => {
                    true
                }
                sqlx::Error::Database(error) => error.code().is_some_and(|code| is_passing_code(&code)),
                _ => false,
            },
            Self::Blobs(error) => !matches!(
                error,
                object_store::Error::NotFound { .. }
                    | object_store::Error::InvalidPath { .. }
                    | object_store::Error::NotSupported { .. }
                    | object_store::Error::NotImplemented { .. }
            ),
            _ => false,
        }
    }

    /// Whether the disk is full.
    #[must_use]
    pub fn is_storage_full(&self) -> bool {
        let error = match self {
            Self::NoRoom { .. } => return true,
            Self::Blobs(error) => error,
            // Postgres and SQLite.
            Self::Database(sqlx::Error::Database(error)) => {
                return error.code().is_some_and(|code| code == "53100" || code == "13");
            }
            _ => return false,
        };
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

/// Postgres: connections (08), conflicts of transactions (40), resources (53), the operator (57). SQLite: busy (5), locked (6), full
/// (13), input and output (10).
fn is_passing_code(code: &str) -> bool {
    let classes = ["08", "40", "53", "57"];
    let is_postgres = code.len() == 5 && classes.iter().any(|class| code.starts_with(class));
    let is_sqlite =
        code.parse::<u32>().is_ok_and(|code| code.to_string().len() < 5 && [5, 6, 10, 13].contains(&(code & 0xff)));
    is_postgres || is_sqlite
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_passes_is_told_from_what_stays() {
        for code in ["57P01", "08006", "40001", "53300", "5", "261", "10"] {
            assert!(is_passing_code(code), "{code} passes");
        }
        for code in ["23505", "42P01", "1", "19", "2067"] {
            assert!(!is_passing_code(code), "{code} stays");
        }
    }
}
