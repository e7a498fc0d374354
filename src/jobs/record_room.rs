//! Room for records: how many there may be, and how many bytes they may have, of one principal and of all.
//!
//! Where there are as many as may be, those that ended first go. The database keeps the counts, and while there is much room left they are
//! asked for now and then only, so that a job that comes costs no question.

use std::{
    collections::BTreeMap,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use super::Refusal;
use crate::{
    config::Settings,
    store::{Principal, RecordCounts, Store},
    telemetry::Metric,
};

/// How long a count stands that is below half of what may be. What this process adds is added to it.
const STANDS_FOR: Duration = Duration::from_secs(5);
/// Principals whose counts are remembered.
const MAX_REMEMBERED: usize = 1000;
/// Removed at once.
const STEP: u64 = 100;
/// How often, for one request: what it may have to wait for.
const MAX_STEPS: usize = 10;

/// What was counted last of each principal, and of all (`None`).
#[derive(Debug, Default)]
pub(super) struct RecordRoom(Mutex<BTreeMap<Option<Principal>, (RecordCounts, Instant)>>);

impl RecordRoom {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Option<Principal>, (RecordCounts, Instant)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether there is so much room that nobody needs to count; then `more` is added.
    fn have_much(&self, of: Option<&Principal>, more: RecordCounts, most: RecordCounts) -> bool {
        let mut known = self.lock();
        let Some((counts, at)) = known.get_mut(&of.cloned()) else { return false };
        counts.jobs += more.jobs;
        counts.bytes += more.bytes;
        at.elapsed() < STANDS_FOR && counts.jobs <= most.jobs / 2 && counts.bytes <= most.bytes / 2
    }

    fn remember(&self, of: Option<&Principal>, counts: RecordCounts) {
        let mut known = self.lock();
        if known.len() >= MAX_REMEMBERED {
            known.clear();
        }
        known.insert(of.cloned(), (counts, Instant::now()));
    }

    /// Makes room for `jobs` more of that owner with so many bytes of texts.
    ///
    /// # Errors
    /// [`Refusal::TooManyRecords`] when nothing has ended that could go.
    pub(super) async fn make(
        &self,
        (store, settings): (&Store, &Settings),
        owner: &Principal,
        jobs: u64,
        bytes: u64,
    ) -> Result<(), Refusal> {
        let more = RecordCounts { jobs, documents: 0, bytes };
        let own = (
            "principal_records",
            settings.max_principal_records,
            "principal_record_bytes",
            settings.max_principal_record_bytes.0,
        );
        let all = ("records", settings.max_records, "record_bytes", settings.max_record_bytes.0);
        self.make_below(store, Some(owner), more, own).await?;
        self.make_below(store, None, more, all).await
    }

    async fn make_below(
        &self,
        store: &Store,
        of: Option<&Principal>,
        more: RecordCounts,
        (jobs_limit, most_jobs, bytes_limit, most_bytes): (&'static str, u64, &'static str, u64),
    ) -> Result<(), Refusal> {
        let most = RecordCounts { jobs: most_jobs, documents: 0, bytes: most_bytes };
        if self.have_much(of, more, most) {
            return Ok(());
        }
        for step in 0.. {
            let counts = self.count(store, of).await?;
            let (jobs, bytes) = (counts.jobs + more.jobs, counts.bytes + more.bytes);
            if jobs <= most_jobs && bytes <= most_bytes {
                return Ok(());
            }
            let removed = if step < MAX_STEPS { store.remove_oldest_ended(of, STEP).await? } else { 0 };
            if removed == 0 {
                Metric::AdmissionRejected.count([("reason", "records".to_owned())], 1);
                return Err(match jobs > most_jobs {
                    true => Refusal::TooManyRecords { limit: jobs_limit, most: most_jobs, actual: jobs },
                    false => Refusal::TooManyRecords { limit: bytes_limit, most: most_bytes, actual: bytes },
                });
            }
            tracing::info!(removed, "the oldest ended jobs went to make room for new ones");
        }
        Ok(())
    }

    async fn count(&self, store: &Store, of: Option<&Principal>) -> Result<RecordCounts, Refusal> {
        let records = store.records();
        let counts = match of {
            Some(owner) => records.record_counts(owner).await?,
            None => records.all_record_counts().await?,
        };
        self.remember(of, counts);
        Ok(counts)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_count_stands_while_there_is_much_room() {
        let room = RecordRoom::default();
        let counts = |jobs: u64| RecordCounts { jobs, documents: 0, bytes: 0 };
        let most = RecordCounts { jobs: 10, documents: 0, bytes: 10 };
        assert!(!room.have_much(None, counts(1), most), "nothing is known");
        room.remember(None, counts(3));
        assert!(room.have_much(None, counts(2), most), "half of it");
        assert!(!room.have_much(None, counts(1), most), "more than half, with what came since");
    }
}
