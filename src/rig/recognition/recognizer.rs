//! What recognition may use beside the skeleton: the user's templates, and what it found lately.

use std::{
    collections::VecDeque,
    sync::{Mutex, PoisonError},
};

use sha2::{Digest, Sha256};

use super::{Hints, Recognition, template::RigTemplate};
use crate::model::{Joint, ModelPose, Skeleton, Transform};

/// What recognition may use beside the skeleton.
#[derive(Clone, Copy, Debug, Default)]
pub struct Recognizer<'a> {
    /// The user's own templates, which are tried before the built-in ones.
    pub templates: &'a [RigTemplate],
    /// What was found lately; without one, every skeleton is looked at anew.
    pub memory: Option<&'a RecognitionMemory>,
}

impl<'a> From<&'a [RigTemplate]> for Recognizer<'a> {
    fn from(templates: &'a [RigTemplate]) -> Self {
        Self { templates, memory: None }
    }
}

/// What was recognized lately. Recognition is a pure function, so what is taken from here is what would be found anew: a thousand clips of one
/// skeleton onto one character need two skeletons looked at.
#[derive(Debug, Default)]
pub struct RecognitionMemory {
    /// The one that was used last is the last.
    kept: Mutex<VecDeque<(InputDigest, Recognition)>>,
}

/// The SHA-256 of everything that recognition looks at.
type InputDigest = [u8; 32];

impl RecognitionMemory {
    /// How many recognitions are kept. A retarget needs one to four.
    const MAX_KEPT: usize = 16;
    /// A larger skeleton is not kept, which bounds the memory that this takes to a few megabytes.
    const MAX_JOINTS: usize = 2048;

    /// What was found for the same input, else what `find` finds now.
    pub(super) fn recall(
        &self,
        skeleton: &Skeleton,
        rest: &ModelPose,
        hints: &Hints<'_>,
        find: impl FnOnce() -> Recognition,
    ) -> Recognition {
        if skeleton.len() > Self::MAX_JOINTS {
            return find();
        }
        let digest = digest(skeleton, rest, hints);
        if let Some(known) = self.take(&digest) {
            self.put(digest, known.clone());
            return known;
        }
        let found = find();
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

/// Everything that recognition looks at, each part with its length before it, so that no two inputs give the same bytes.
fn digest(skeleton: &Skeleton, rest: &ModelPose, hints: &Hints<'_>) -> InputDigest {
    let Hints { declared, convention, recognizer: Recognizer { templates, memory: _ }, hidden, excluded } = *hints;
    let mut bytes = Vec::with_capacity(256 * skeleton.len());
    let count = |bytes: &mut Vec<u8>, count: usize| bytes.extend((count as u64).to_le_bytes());
    let text = |bytes: &mut Vec<u8>, text: &str| {
        count(bytes, text.len());
        bytes.extend(text.as_bytes());
    };
    count(&mut bytes, skeleton.len());
    for Joint { name, parent, rest, is_joint, node } in skeleton.joints() {
        text(&mut bytes, name);
        count(&mut bytes, parent.map_or(0, |parent| parent + 1));
        transform(&mut bytes, rest);
        bytes.push(u8::from(*is_joint));
        count(&mut bytes, *node);
    }
    count(&mut bytes, rest.transforms().len());
    rest.transforms().iter().for_each(|placed| transform(&mut bytes, placed));
    count(&mut bytes, declared.len());
    for (role, joint) in declared {
        text(&mut bytes, role);
        count(&mut bytes, *joint);
    }
    bytes.push(u8::from(convention.is_some()));
    text(&mut bytes, convention.unwrap_or_default());
    count(&mut bytes, hidden.len());
    hidden.iter().for_each(|joint| count(&mut bytes, *joint));
    count(&mut bytes, excluded.len());
    bytes.extend(excluded.iter().map(|is_excluded| u8::from(*is_excluded)));
    for template in templates {
        // A template that cannot be written is told from all others by its words.
        let written = serde_json::to_string(template).unwrap_or_else(|_| format!("{template:?}"));
        text(&mut bytes, &written);
    }
    Sha256::digest(&bytes).into()
}

/// Bit by bit: a zero with a sign may turn an angle around.
fn transform(bytes: &mut Vec<u8>, transform: &Transform) {
    let Transform { translation, rotation, scale } = transform;
    let numbers = translation.to_array().into_iter().chain(rotation.to_array()).chain(scale.to_array());
    numbers.for_each(|number| bytes.extend(number.to_bits().to_le_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{rig::recognition::recognize, samples};

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
    fn whatever_recognition_looks_at_makes_a_difference() {
        let scene = samples::walk_scene();
        let skeleton = &scene.skeleton;
        let rest = skeleton.rest_pose().to_model(skeleton);
        let plain = digest(skeleton, &rest, &Hints::default());
        let mut moved = skeleton.rest_pose();
        moved.transforms_mut()[3].translation.x = -0.0;
        let excluded = vec![false; skeleton.len()];
        let others = [
            digest(skeleton, &moved.to_model(skeleton), &Hints::default()),
            digest(skeleton, &rest, &Hints { excluded: &excluded, ..Hints::default() }),
            digest(skeleton, &rest, &Hints { hidden: &[1], ..Hints::default() }),
            digest(skeleton, &rest, &Hints { convention: Some(""), ..Hints::default() }),
            digest(skeleton, &rest, &Hints { declared: &[("hips".to_owned(), 1)], ..Hints::default() }),
            digest(
                skeleton,
                &rest,
                &Hints { recognizer: super::super::builtin_templates().into(), ..Hints::default() },
            ),
        ];
        for (index, other) in others.iter().enumerate() {
            assert_ne!(*other, plain, "{index}");
            assert!(!others[..index].contains(other), "{index}");
        }
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
