//! Durable facts: records in a database, bytes in a blob store.
//!
//! A blob is named by the SHA-256 of its bytes and shared by every record that has it; it becomes visible only when it is
//! complete. A record is written in one transaction. [`Store`] is the pair, with the one rule that needs both: a blob that
//! no record names is removed. One process writes to a data folder; [`DataFolder`] sees to that.
//!
//! Knows nothing of scheduling, of HTTP, and of what is in a file. Never reads the clock: times come from the caller.

mod blobs;
mod error;
mod folder;
mod id;
mod records;
#[cfg(test)]
mod tests;

pub use blobs::{Blob, BlobWriter, Blobs, ByteStream, UnnamedBlob};
pub use error::StoreError;
pub use folder::DataFolder;
pub use id::{AssetId, IdError, JobId, ResultId};
pub use records::{
    AssetRecord, ConfigDocument, DocumentChange, DocumentKind, DocumentRecord, FinishedJob, InputRole, JobFailure,
    JobInput, JobRecord, JobRequest, JobState, NewDocument, Page, Precondition, Records, ResultRecord,
    StoredFieldError, VersionedName,
};

use jiff::Timestamp;
use tokio::sync::{Mutex, MutexGuard};

/// Records and blobs, kept in step.
#[derive(Debug)]
pub struct Store {
    records: Records,
    blobs: Blobs,
    /// Held while a blob gets its first record or loses its last, so that neither can happen in the middle of the other.
    blob_gate: Mutex<()>,
}

impl Store {
    /// Puts the two together.
    #[must_use]
    pub fn new(records: Records, blobs: Blobs) -> Self {
        Self { records, blobs, blob_gate: Mutex::new(()) }
    }

    /// Opens both inside a data folder.
    ///
    /// # Errors
    /// When the database or the blob folder cannot be opened.
    pub async fn open(folder: &DataFolder) -> Result<Self, StoreError> {
        Ok(Self::new(Records::open(&folder.database()).await?, Blobs::local(folder.root())?))
    }

    /// The records.
    #[must_use]
    pub const fn records(&self) -> &Records {
        &self.records
    }

    /// The blobs.
    #[must_use]
    pub const fn blobs(&self) -> &Blobs {
        &self.blobs
    }

    /// To be held from before a blob is made visible until a record names it.
    pub async fn hold_blobs(&self) -> MutexGuard<'_, ()> {
        self.blob_gate.lock().await
    }

    /// Removes those of `digests` that no record names.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove_unnamed(&self, digests: &[String]) -> Result<(), StoreError> {
        for digest in digests {
            let _held = self.hold_blobs().await;
            if !self.records.names_blob(digest).await? {
                self.blobs.remove(digest).await?;
            }
        }
        Ok(())
    }

    /// Removes every record that has expired by `now`, and the blobs that nothing names then. Inputs of unfinished jobs stay.
    /// Gives the number of records removed.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn sweep(&self, now: Timestamp) -> Result<u64, StoreError> {
        let (count, digests) = self.records.remove_expired(now).await?;
        self.remove_unnamed(&digests).await?;
        Ok(count)
    }
}
