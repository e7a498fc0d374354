//! What was found in files, remembered for as long as this process lives: a new version begins anew, and what depends on the
//! users' templates is asked for by their digest.

use std::{
    collections::{BTreeMap, VecDeque},
    sync::{Arc, Mutex, PoisonError, Weak},
};

use crate::{engine::Failure, store::AssetRecord};

/// What an answer depends on.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct InspectionKey {
    /// Of the file.
    pub(super) sha256: String,
    /// Wire name of its format.
    pub(super) format: String,
    /// Of the users' templates.
    pub(super) rigs_sha256: String,
}

impl InspectionKey {
    /// The key of a file, with the users' templates as they are now.
    pub(super) fn of(asset: &AssetRecord, rigs_sha256: &str) -> Self {
        Self { sha256: asset.sha256.clone(), format: asset.format.clone(), rigs_sha256: rigs_sha256.to_owned() }
    }
}

/// An answer, and what it says of the memory that a job on the file needs.
#[derive(Clone, Debug)]
pub(super) struct Found {
    pub(super) document: Arc<str>,
    pub(super) memory_bytes: Option<u64>,
}

/// The latest answers, bounded by their bytes.
#[derive(Debug, Default)]
pub(super) struct Inspections {
    kept: Mutex<VecDeque<(InspectionKey, Found)>>,
    /// Looks that are at work, each with why it failed, for those who wait for it.
    at_work: Mutex<BTreeMap<InspectionKey, Weak<SharedLook>>>,
}

/// What those have in common who ask for the same at the same time: one of them looks, and leaves why that failed where it did.
pub(super) type SharedLook = tokio::sync::Mutex<Option<Failure>>;

impl Inspections {
    /// Enough for a few hundred characters.
    const MAX_BYTES: usize = 32 << 20;

    pub(super) fn find(&self, key: &InspectionKey) -> Option<Arc<str>> {
        self.found(key).map(|found| found.document)
    }

    /// The look of that key which is at work, or about to be.
    pub(super) fn shared(&self, key: &InspectionKey) -> Arc<SharedLook> {
        let mut at_work = self.at_work.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(shared) = at_work.get(key).and_then(Weak::upgrade) {
            return shared;
        }
        at_work.retain(|_, shared| shared.strong_count() > 0);
        let shared = Arc::new(SharedLook::default());
        at_work.insert(key.clone(), Arc::downgrade(&shared));
        shared
    }

    /// What is known of the memory that a job on the file needs.
    pub(super) fn memory_bytes(&self, key: &InspectionKey) -> Option<u64> {
        self.found(key)?.memory_bytes
    }

    fn found(&self, key: &InspectionKey) -> Option<Found> {
        let kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|(other, _)| other == key).map(|(_, found)| found.clone())
    }

    /// Remembers an answer, and forgets the oldest ones where there is no room.
    pub(super) fn add(&self, key: InspectionKey, found: Found) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(other, _)| *other != key);
        kept.push_back((key, found));
        let mut bytes: usize = kept.iter().map(|(_, found)| found.document.len()).sum();
        while bytes > Self::MAX_BYTES {
            let Some((_, oldest)) = kept.pop_front() else { return };
            bytes -= oldest.document.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(sha256: &str, rigs: &str) -> InspectionKey {
        InspectionKey { sha256: sha256.to_owned(), format: "glb".to_owned(), rigs_sha256: rigs.to_owned() }
    }

    fn found(document: &str) -> Found {
        Found { document: document.into(), memory_bytes: Some(document.len() as u64) }
    }

    #[test]
    fn other_templates_ask_anew_and_the_oldest_go_first() {
        let inspections = Inspections::default();
        inspections.add(key("a", "1"), found("first"));
        assert_eq!(inspections.find(&key("a", "1")).as_deref(), Some("first"), "remembered");
        assert_eq!(inspections.find(&key("a", "2")), None, "the templates have changed");
        assert_eq!(inspections.memory_bytes(&key("a", "1")), Some(5), "with what was found out");
        inspections.add(key("b", "1"), found(&"x".repeat(Inspections::MAX_BYTES - 10)));
        assert!(inspections.find(&key("a", "1")).is_some(), "there is room for both");
        inspections.add(key("c", "1"), found("more than is left"));
        assert_eq!(inspections.find(&key("a", "1")), None, "the oldest went");
        assert!(inspections.find(&key("c", "1")).is_some(), "the newest stays");
    }
}
