//! Records, in SQLite or in Postgres.
//!
//! Both understand one text for nearly every query, so there is one set of queries, run through sqlx's driver that is chosen at run
//! time; [`dialect`] has the few words in which they differ. Every table keeps texts and whole numbers only, which is all that this
//! driver knows, and all that is needed.

mod api_keys;
mod assets;
mod batch_record;
mod batches;
mod blob_names;
mod database;
mod database_clock;
mod deliveries;
mod dialect;
mod documents;
mod engine_time;
mod events;
mod faults;
mod job_lists;
mod job_record;
mod jobs;
mod new_jobs;
mod notices;
mod queue;
mod record_counts;
mod result_cache;
mod results;
mod sweep;
mod verdict;
mod webhooks;

use dialect::Dialect;

pub use api_keys::{ApiKeyRecord, Scope};
pub use batch_record::{AddedAgain, AddedBatch, BatchProgress, BatchRecord, OnError, StoppedBatch};
pub(in crate::store) use database::{BlobLocks, Lock};
pub use database::{PoolUse, Records};
pub use deliveries::{AfterAttempt, AttemptEnd, DeliveryClaim, DeliveryEvent, DeliveryRecord, DeliveryState};
pub use documents::{
    DocumentBounds, DocumentChange, DocumentHead, DocumentKind, DocumentRecord, NewDocument, Precondition,
};
pub use engine_time::{BRIEF, Wanted};
pub use events::{EventReach, EventRecord};
pub use faults::{Faults, Moment};
pub use job_lists::{Holdings, JobFilter};
pub use job_record::{
    Added, BatchPlace, ConfigDocument, Ended, FinishedJob, Held, Idempotency, InputRole, JobFailure, JobInput, JobKind,
    JobRecord, JobRequest, JobState, JobTask, Lane, StoredFieldError, StoredProgress, VersionedName,
};
pub use notices::{Listener, Notice};
pub use queue::{AfterCrash, Claim, GiveBack, QueueDepth};
pub use record_counts::RecordCounts;
pub use result_cache::CachedResults;
pub use verdict::{JobVerdict, Judgment};
pub use webhooks::{DisabledReason, WebhookRecord};

use std::time::Duration;

use jiff::Timestamp;
use sqlx::{Row, any::AnyRow};

use super::{AssetId, IdError, JobId, Principal, ResultId, StoreError};

/// An uploaded file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AssetRecord {
    /// Its name.
    pub id: AssetId,
    /// Who owns it.
    pub principal: Principal,
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

fn time(row: &AnyRow, column: &str) -> Result<Timestamp, StoreError> {
    from_milliseconds(row.try_get(column)?)
}

fn optional_time(row: &AnyRow, column: &str) -> Result<Option<Timestamp>, StoreError> {
    row.try_get::<Option<i64>, _>(column)?.map(from_milliseconds).transpose()
}

fn from_milliseconds(milliseconds: i64) -> Result<Timestamp, StoreError> {
    Timestamp::from_millisecond(milliseconds)
        .map_err(|error| StoreError::Unreadable { record: milliseconds.to_string(), reason: error.to_string() })
}

/// Byte counts fit: nothing stored is larger than 2^63 bytes.
fn count(row: &AnyRow, column: &str) -> Result<u64, StoreError> {
    Ok(u64::try_from(row.try_get::<i64, _>(column)?).unwrap_or(0))
}

fn signed(count: u64) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

fn milliseconds(period: Duration) -> i64 {
    i64::try_from(period.as_millis()).unwrap_or(i64::MAX)
}

fn read_id<T>(row: &AnyRow, column: &str, parse: fn(&str) -> Result<T, IdError>) -> Result<T, StoreError> {
    let text: String = row.try_get(column)?;
    parse(&text).map_err(|error| StoreError::Unreadable { reason: error.to_string(), record: text })
}

fn principal(row: &AnyRow) -> Result<Principal, StoreError> {
    let text: String = row.try_get("principal")?;
    Principal::restore(&text).map_err(|error| StoreError::Unreadable { reason: error.to_string(), record: text })
}

/// A text as both databases can hold it: Postgres has no NUL in texts.
fn without_nul(text: &str) -> String {
    text.replace('\0', "")
}
