//! How many event streams are open.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use super::Refusal;
use crate::{store::Principal, telemetry::Metric};

/// How many streams each principal has open at this process.
#[derive(Debug, Default)]
pub(super) struct OpenStreams(Mutex<BTreeMap<Principal, u64>>);

impl OpenStreams {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<Principal, u64>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many one principal has open.
    pub(super) fn count(&self, owner: &Principal) -> u64 {
        self.lock().get(owner).copied().unwrap_or(0)
    }

    pub(super) fn open(self: &Arc<Self>, owner: &Principal, most: u64) -> Result<OpenStream, Refusal> {
        let mut counts = self.lock();
        let count = counts.get(owner).copied().unwrap_or(0);
        if count >= most {
            return Err(Refusal::TooManyStreams { most });
        }
        counts.insert(owner.clone(), count + 1);
        drop(counts);
        Metric::EventStreams.change(1.0);
        Ok(OpenStream { streams: Arc::clone(self), owner: owner.clone() })
    }
}

/// One of them, until it is dropped.
#[derive(Debug)]
pub(super) struct OpenStream {
    streams: Arc<OpenStreams>,
    owner: Principal,
}

impl Drop for OpenStream {
    fn drop(&mut self) {
        let mut counts = self.streams.lock();
        match counts.get_mut(&self.owner) {
            Some(count) if *count > 1 => *count -= 1,
            _ => {
                counts.remove(&self.owner);
            }
        }
        drop(counts);
        Metric::EventStreams.change(-1.0);
    }
}
