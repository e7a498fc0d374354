//! Records, in SQLite.
//!
//! The file is written ahead of (WAL) and every writing transaction begins as a writer, because one that turns into a
//! writer half way fails at once when another is writing, whatever the busy timeout.

mod assets;
mod database;
mod documents;
mod job_record;
mod jobs;
mod results;
mod sweep;

pub use database::Records;
pub use documents::{DocumentChange, DocumentKind, DocumentRecord, NewDocument, Precondition};
pub use job_record::{
    ConfigDocument, FinishedJob, InputRole, JobFailure, JobInput, JobRecord, JobRequest, JobState, StoredFieldError,
    VersionedName,
};

use jiff::Timestamp;
use sqlx::{Row, sqlite::SqliteRow};

use super::{AssetId, IdError, JobId, ResultId, StoreError};

/// An uploaded file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetRecord {
    /// Its name.
    pub id: AssetId,
    /// The blob with its bytes.
    pub sha256: String,
    /// How many.
    pub bytes: u64,
    /// Wire name of its format, from its bytes.
    pub format: String,
    /// What the user called it. May be empty.
    pub file_name: String,
    /// When it came.
    pub created_at: Timestamp,
    /// When it may be removed.
    pub expires_at: Timestamp,
}

/// A file that a job gave.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ResultRecord {
    /// Its name.
    pub id: ResultId,
    /// The job that gave it.
    pub job_id: JobId,
    /// Wire name of its format.
    pub format: String,
    /// A name to save it under.
    pub file_name: String,
    /// The blob with its bytes.
    pub sha256: String,
    /// How many.
    pub bytes: u64,
    /// When it was made.
    pub created_at: Timestamp,
    /// When it may be removed.
    pub expires_at: Timestamp,
}

/// One page of a list, newest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Page<T> {
    /// The entries.
    pub items: Vec<T>,
    /// Whether more come after the last.
    pub has_more: bool,
}

impl<T> Page<T> {
    /// A page from up to one entry more than it may have.
    fn cut(mut items: Vec<T>, most: usize) -> Self {
        let has_more = items.len() > most;
        items.truncate(most);
        Self { items, has_more }
    }
}

fn time(row: &SqliteRow, column: &str) -> Result<Timestamp, StoreError> {
    from_milliseconds(row.try_get(column)?)
}

fn optional_time(row: &SqliteRow, column: &str) -> Result<Option<Timestamp>, StoreError> {
    row.try_get::<Option<i64>, _>(column)?.map(from_milliseconds).transpose()
}

fn from_milliseconds(milliseconds: i64) -> Result<Timestamp, StoreError> {
    Timestamp::from_millisecond(milliseconds)
        .map_err(|error| StoreError::Unreadable { record: milliseconds.to_string(), reason: error.to_string() })
}

/// Byte counts fit: nothing stored is larger than 2^63 bytes.
fn count(row: &SqliteRow, column: &str) -> Result<u64, StoreError> {
    Ok(u64::try_from(row.try_get::<i64, _>(column)?).unwrap_or(0))
}

fn signed(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

fn read_id<T>(row: &SqliteRow, column: &str, parse: fn(&str) -> Result<T, IdError>) -> Result<T, StoreError> {
    let text: String = row.try_get(column)?;
    parse(&text).map_err(|error| StoreError::Unreadable { reason: error.to_string(), record: text })
}
