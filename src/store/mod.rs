//! Durable facts: records in a database, bytes in a blob store.
//!
//! A blob is named by the SHA-256 of its bytes and shared by every record that has it; it becomes visible only when it is
//! complete. A record is written in one transaction. [`Store`] is the pair, with the one rule that needs both: a blob that
//! no record names is removed. One process writes to a data folder; [`DataFolder`] sees to that. Any number of processes share a
//! Postgres database with an S3-compatible store or a folder of blobs.
//!
//! Knows nothing of scheduling, of HTTP, and of what is in a file. Never reads the clock: times come from the caller, and those of the
//! queue from the database.

mod blobs;
mod error;
mod folder;
mod id;
mod principal;
mod records;
#[cfg(test)]
mod tests;

pub use blobs::{Blob, BlobPlace, BlobWriter, Blobs, ByteStream, UnnamedBlob};
pub use error::StoreError;
pub use folder::DataFolder;
pub use id::{ApiKeyId, AssetId, BatchId, DeliveryId, IdError, JobId, LeaseId, ResultId, WebhookId};
pub use principal::{Principal, PrincipalError};
pub use records::{
    Added, AddedAgain, AddedBatch, AfterAttempt, AfterCrash, ApiKeyRecord, AssetRecord, AttemptEnd, BRIEF, BatchPlace,
    BatchProgress, BatchRecord, CachedResults, Claim, ConfigDocument, DeliveryClaim, DeliveryEvent, DeliveryRecord,
    DeliveryState, DisabledReason, DocumentBounds, DocumentChange, DocumentHead, DocumentKind, DocumentRecord, Ended,
    EventReach, EventRecord, Faults, FinishedJob, GiveBack, Held, Holdings, Idempotency, InputRole, JobFailure,
    JobFilter, JobInput, JobKind, JobRecord, JobRequest, JobState, JobTask, JobVerdict, Judgment, Lane, Listener,
    Moment, NewDocument, Notice, OnError, Page, PoolUse, Precondition, QueueDepth, RecordCounts, Records, ResultRecord,
    Scope, StoppedBatch, StoredFieldError, StoredProgress, VersionedName, Wanted, WebhookRecord,
};

use std::{collections::BTreeSet, fmt::Write as _, sync::Arc};

use jiff::{SignedDuration, Timestamp};
use tokio::sync::{OwnedRwLockReadGuard, RwLock};

use records::{BlobLocks, Lock};

/// Bytes as lower-case hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::with_capacity(bytes.len() * 2), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

/// Records and blobs, kept in step.
#[derive(Debug)]
pub struct Store {
    records: Records,
    blobs: Blobs,
    /// Held while a blob gets a record or loses its last, so that neither can happen in the middle of the other. Among processes,
    /// locks of the database do the same. Each is for some of the blobs, so that who removes one waits for few.
    blob_gates: Vec<Arc<RwLock<()>>>,
}

/// Gates of a store.
const GATES: usize = 64;

/// The gate of a blob.
fn gate_of(digest: &str) -> usize {
    digest.bytes().take(8).fold(0, |sum: usize, byte| sum.wrapping_mul(31).wrapping_add(usize::from(byte))) % GATES
}

/// Until it is dropped, none of its blobs is removed.
#[derive(Debug)]
pub struct HeldBlobs {
    _here: Vec<OwnedRwLockReadGuard<()>>,
    _everywhere: BlobLocks,
}

impl Store {
    /// Puts the two together.
    #[must_use]
    pub fn new(records: Records, blobs: Blobs) -> Self {
        Self { records, blobs, blob_gates: (0..GATES).map(|_| Arc::default()).collect() }
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

    /// To be held from before blobs of these digests are made visible until a record names them.
    ///
    /// # Errors
    /// When the database fails.
    pub async fn hold_blobs(&self, digests: &[&str]) -> Result<HeldBlobs, StoreError> {
        // In their order, so that no two wait for each other.
        let gates: BTreeSet<usize> = digests.iter().map(|digest| gate_of(digest)).collect();
        let mut here = Vec::with_capacity(gates.len());
        for gate in gates {
            here.push(Arc::clone(&self.blob_gates[gate]).read_owned().await);
        }
        Ok(HeldBlobs { _here: here, _everywhere: self.records.lock_blobs(digests, Lock::Shared).await? })
    }

    /// Removes those of `digests` that no record names.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove_unnamed(&self, digests: &[String]) -> Result<(), StoreError> {
        for digest in digests {
            let _here = self.blob_gates[gate_of(digest)].write().await;
            let _everywhere = self.records.lock_blobs(&[digest], Lock::Alone).await?;
            if !self.records.names_blob(digest).await? {
                self.blobs.remove(digest).await?;
            }
        }
        Ok(())
    }

    /// Removes what crashes left: blobs that no record names, and unfinished ones. Young ones stay, since somebody may be about to
    /// write their record.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove_leftovers(&self, now: Timestamp) -> Result<(), StoreError> {
        let before = |hours: i64| now.checked_sub(SignedDuration::from_hours(hours)).unwrap_or(Timestamp::MIN);
        // Nearly all have names: those that have none are found by many at once, and only they are locked.
        let old = self.blobs.written_before(before(1)).await?;
        for digests in old.chunks(100) {
            self.remove_unnamed(&self.records.unnamed_blobs(digests).await?).await?;
        }
        self.blobs.remove_unfinished_before(before(24)).await
    }

    /// Removes every record that has expired by `now`, and the blobs that nothing names then. Inputs of unfinished jobs stay.
    /// Gives the number of records removed.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn sweep(&self, now: Timestamp) -> Result<u64, StoreError> {
        let mut removed = 0;
        loop {
            let (count, digests) = self.records.remove_expired(now).await?;
            self.remove_unnamed(&digests).await?;
            removed += count;
            if count == 0 {
                break;
            }
        }
        self.records.tidy(now).await?;
        Ok(removed)
    }

    /// Removes up to `most` jobs that have ended, those that ended first, of one principal or of all, and what they gave. Gives how many.
    ///
    /// # Errors
    /// When the store fails.
    pub async fn remove_oldest_ended(&self, owner: Option<&Principal>, most: u64) -> Result<u64, StoreError> {
        let (count, digests) = self.records.remove_oldest_ended(owner, most).await?;
        self.remove_unnamed(&digests).await?;
        Ok(count)
    }
}
