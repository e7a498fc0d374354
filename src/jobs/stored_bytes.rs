//! How many bytes are stored, without counting them for every upload: counting takes as long as there are many.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crate::store::{AssetRecord, Records, StoreError};

/// How long a count stands. What this process adds meanwhile is added to it; what others add is not.
const STANDS_FOR: Duration = Duration::from_secs(1);

/// What was counted last, and what has come since.
#[derive(Debug, Default)]
pub(super) struct StoredBytes(Mutex<Known>);

#[derive(Debug, Default)]
struct Known {
    bytes: u64,
    at: Option<Instant>,
}

impl StoredBytes {
    /// Whether `more` bytes fit below `most`. Before it says no, it counts.
    ///
    /// # Errors
    /// When the database fails.
    pub(super) async fn have_room(&self, records: &Records, more: u64, most: u64) -> Result<bool, StoreError> {
        let fits = |bytes: u64| bytes.saturating_add(more) <= most;
        if self.known().is_some_and(fits) {
            return Ok(true);
        }
        Ok(fits(self.count(records).await?))
    }

    /// Counts.
    ///
    /// # Errors
    /// When the database fails.
    pub(super) async fn count(&self, records: &Records) -> Result<u64, StoreError> {
        let bytes = records.stored_bytes().await?;
        *self.lock() = Known { bytes, at: Some(Instant::now()) };
        Ok(bytes)
    }

    /// That many have come.
    pub(super) fn add(&self, bytes: u64) {
        let mut known = self.lock();
        known.bytes = known.bytes.saturating_add(bytes);
    }

    /// Of these files those that are new have come.
    pub(super) fn add_new(&self, kept: &[(AssetRecord, bool)]) {
        self.add(kept.iter().filter(|(_, is_new)| *is_new).map(|(asset, _)| asset.bytes).sum());
    }

    fn known(&self) -> Option<u64> {
        let known = self.lock();
        known.at.filter(|at| at.elapsed() < STANDS_FOR).map(|_| known.bytes)
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
