//! Pictures that were drawn, remembered for a while.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
};

use bytes::Bytes;

/// The latest pictures by their keys, bounded by their bytes.
#[derive(Debug, Default)]
pub(super) struct KeptPictures(Mutex<VecDeque<(String, Bytes)>>);

impl KeptPictures {
    const MAX_BYTES: usize = 32 << 20;

    /// The picture of a key.
    pub(super) fn find(&self, key: &str) -> Option<Bytes> {
        let kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.iter().find(|(other, _)| other == key).map(|(_, picture)| picture.clone())
    }

    /// Remembers a picture, and forgets the oldest ones where there is no room.
    pub(super) fn add(&self, key: String, picture: Bytes) {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        kept.retain(|(other, _)| *other != key);
        kept.push_back((key, picture));
        let mut bytes: usize = kept.iter().map(|(_, picture)| picture.len()).sum();
        while bytes > Self::MAX_BYTES {
            let Some((_, oldest)) = kept.pop_front() else { return };
            bytes -= oldest.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_pictures_are_forgotten() {
        let previews = KeptPictures::default();
        previews.add("a".to_owned(), Bytes::from_static(b"first"));
        previews.add("b".to_owned(), vec![0; KeptPictures::MAX_BYTES - 10].into());
        assert_eq!(previews.find("a").as_deref(), Some(&b"first"[..]), "there is room for both");
        previews.add("c".to_owned(), Bytes::from_static(b"more than is left"));
        assert_eq!(previews.find("a"), None, "the oldest went");
        assert!(previews.find("c").is_some(), "the newest stays");
    }
}
