//! What was found in files, remembered for as long as this process lives: a new version begins anew, and what depends on the
//! users' templates is asked for by their digest.

use std::{
    collections::VecDeque,
    sync::{Arc, Mutex, PoisonError},
};

/// What an answer depends on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct InspectionKey {
    /// Of the file.
    pub(super) sha256: String,
    /// Wire name of its format.
    pub(super) format: String,
    /// Of the users' templates.
    pub(super) rigs_sha256: String,
}

/// The latest answers, bounded by their bytes.
#[derive(Debug, Default)]
pub(super) struct Inspections(Mutex<VecDeque<(InspectionKey, Arc<str>)>>);

impl Inspections {
    /// Enough for a few hundred characters.
    const MOST_BYTES: usize = 32 << 20;

    pub(super) fn find(&self, key: &InspectionKey) -> Option<Arc<str>> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|(other, _)| other == key).map(|(_, document)| Arc::clone(document))
    }

    /// Remembers an answer, and forgets the oldest ones where there is no room.
    pub(super) fn add(&self, key: InspectionKey, document: &Arc<str>) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(other, _)| *other != key);
        kept.push_back((key, Arc::clone(document)));
        let mut bytes: usize = kept.iter().map(|(_, document)| document.len()).sum();
        while bytes > Self::MOST_BYTES {
            let Some((_, oldest)) = kept.pop_front() else { return };
            bytes -= oldest.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn key(sha256: &str, rigs: &str) -> InspectionKey {
        InspectionKey { sha256: sha256.to_owned(), format: "glb".to_owned(), rigs_sha256: rigs.to_owned() }
    }

    #[test]
    fn other_templates_ask_anew_and_the_oldest_go_first() {
        let inspections = Inspections::default();
        inspections.add(key("a", "1"), &"first".into());
        assert_eq!(inspections.find(&key("a", "1")).as_deref(), Some("first"), "remembered");
        assert_eq!(inspections.find(&key("a", "2")), None, "the templates have changed");
        let large: Arc<str> = "x".repeat(Inspections::MOST_BYTES - 10).into();
        inspections.add(key("b", "1"), &large);
        assert!(inspections.find(&key("a", "1")).is_some(), "there is room for both");
        inspections.add(key("c", "1"), &"more than is left".into());
        assert_eq!(inspections.find(&key("a", "1")), None, "the oldest went");
        assert!(inspections.find(&key("c", "1")).is_some(), "the newest stays");
    }
}
