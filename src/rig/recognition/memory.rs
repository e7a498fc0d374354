//! What was recognized lately.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
};

use super::recognition_result::Recognition;

/// What was recognized lately. Recognition is a pure function, so what is taken from here is what would be found anew: a thousand clips of one
/// skeleton onto one character need two skeletons looked at.
#[derive(Debug, Default)]
pub struct RecognitionMemory {
    /// The one that was used last is the last.
    kept: Mutex<VecDeque<(InputDigest, Recognition)>>,
}

/// The SHA-256 of everything that recognition looks at.
pub(super) type InputDigest = [u8; 32];

impl RecognitionMemory {
    /// How many recognitions are kept. A retarget needs one to four.
    const MAX_KEPT: usize = 16;
    /// A larger skeleton is not kept, which bounds the memory that this takes to a few megabytes.
    pub(super) const MAX_JOINTS: usize = 2048;

    /// What was found for the same input, else what `find` finds now.
    pub(super) fn recall(&self, digest: InputDigest, find: impl FnOnce() -> Recognition) -> Recognition {
        let found = self.take(&digest).unwrap_or_else(find);
        self.put(digest, found.clone());
        found
    }

    fn take(&self, digest: &InputDigest) -> Option<Recognition> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let place = kept.iter().position(|(known, _)| known == digest)?;
        kept.remove(place).map(|(_, recognition)| recognition)
    }

    fn put(&self, digest: InputDigest, recognition: Recognition) {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.len() == Self::MAX_KEPT {
            kept.pop_front();
        }
        kept.push_back((digest, recognition));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        rig::recognition::{Hints, Recognizer, recognize},
        samples,
    };

    #[test]
    fn what_is_recalled_is_what_would_be_found() {
        let memory = RecognitionMemory::default();
        let scene = samples::walk_scene();
        let rest = scene.skeleton.rest_pose().to_model(&scene.skeleton);
        let plain = recognize(&scene.skeleton, &rest, &Hints::of(&scene));
        let recognizer = Recognizer { templates: &[], memory: Some(&memory) };
        for _ in 0..2 {
            let found = recognize(&scene.skeleton, &rest, &Hints { recognizer, ..Hints::of(&scene) });
            assert_eq!(format!("{found:?}"), format!("{plain:?}"));
        }
        assert_eq!(memory.kept.lock().expect("kept").len(), 1, "once");
    }

    #[test]
    fn it_forgets_what_was_not_used_for_long() {
        let memory = RecognitionMemory::default();
        let known = |number: u8| memory.take(&[number; 32]).is_some();
        for number in 0..=u8::try_from(RecognitionMemory::MAX_KEPT).expect("few") {
            memory.put([number; 32], Recognition::default());
        }
        assert!(!known(0) && known(1), "the oldest is gone");
    }
}
