//! Everything that recognition looks at, as one number: what has the same is recognized as the same.

use sha2::{Digest, Sha256};

use super::{Hints, memory::InputDigest, recognizer::Recognizer};
use crate::model::{Joint, ModelPose, Skeleton, Transform};

/// Everything that recognition looks at, each part with its length before it, so that no two inputs give the same bytes.
pub(super) fn input_digest(skeleton: &Skeleton, rest: &ModelPose, hints: &Hints<'_>) -> InputDigest {
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
    use crate::{rig::recognition::builtin_templates, samples};

    #[test]
    fn whatever_recognition_looks_at_makes_a_difference() {
        let scene = samples::walk_scene();
        let skeleton = &scene.skeleton;
        let rest = skeleton.rest_pose().to_model(skeleton);
        let plain = input_digest(skeleton, &rest, &Hints::default());
        let mut moved = skeleton.rest_pose();
        moved.transforms_mut()[3].translation.x += 1e-9;
        let excluded = vec![false; skeleton.len()];
        let others = [
            input_digest(skeleton, &moved.to_model(skeleton), &Hints::default()),
            input_digest(skeleton, &rest, &Hints { excluded: &excluded, ..Hints::default() }),
            input_digest(skeleton, &rest, &Hints { hidden: &[1], ..Hints::default() }),
            input_digest(skeleton, &rest, &Hints { convention: Some(""), ..Hints::default() }),
            input_digest(skeleton, &rest, &Hints { declared: &[("hips".to_owned(), 1)], ..Hints::default() }),
            input_digest(skeleton, &rest, &Hints { recognizer: builtin_templates().into(), ..Hints::default() }),
        ];
        for (index, other) in others.iter().enumerate() {
            assert_ne!(*other, plain, "{index}");
            assert!(!others[..index].contains(other), "{index}");
        }
        let bytes = |x: f64| {
            let mut bytes = Vec::new();
            transform(&mut bytes, &Transform { translation: glam::DVec3::X * x, ..Transform::IDENTITY });
            bytes
        };
        assert_ne!(bytes(0.0), bytes(-0.0), "the sign of a zero");
    }
}
