//! How many bytes are stored, without counting them for every upload: counting takes as long as there are many.

use std::{
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use crate::store::{AssetRecord, Records, StoreError};

/// How long a count stands at least. What this process adds meanwhile is added to it; what others add is not.
const STANDS_FOR: Duration = Duration::from_secs(1);
/// And how many times longer than it took. Where there are so many that counting takes long, the sweeper counts again before that is over, and
/// nobody who uploads waits for it.
const TIMES_ITS_COST: u32 = 1000;

/// What was counted last, and what has come since.
#[derive(Debug, Default)]
pub(super) struct StoredBytes(Mutex<Known>);

#[derive(Debug, Default)]
struct Known {
    bytes: u64,
    at: Option<Instant>,
    stands_for: Duration,
}

impl StoredBytes {
    /// How many bytes there are with `more`, where that is more than `most`. Before it says so, it counts, at most once a second.
    ///
    /// # Errors
    /// When the database fails.
    pub(super) async fn too_many_with(
        &self,
        records: &Records,
        more: u64,
        most: u64,
    ) -> Result<Option<u64>, StoreError> {
        let too_many = |bytes: u64| Some(bytes.saturating_add(more)).filter(|with| *with > most);
        match self.known().map(|(bytes, age)| (too_many(bytes), age)) {
            Some((None, _)) => return Ok(None),
            Some((actual, age)) if age < STANDS_FOR => return Ok(actual),
            _ => {}
        }
        Ok(too_many(self.count(records).await?))
    }

    /// Counts.
    ///
    /// # Errors
    /// When the database fails.
    pub(super) async fn count(&self, records: &Records) -> Result<u64, StoreError> {
        let began = Instant::now();
        let bytes = records.stored_bytes().await?;
        let stands_for = STANDS_FOR.max(began.elapsed() * TIMES_ITS_COST);
        *self.lock() = Known { bytes, at: Some(Instant::now()), stands_for };
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

    /// What was counted, and how long ago, while that stands.
    fn known(&self) -> Option<(u64, Duration)> {
        let known = self.lock();
        let age = known.at?.elapsed();
        (age < known.stands_for).then_some((known.bytes, age))
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
