//! What holds for every scene that was read, whatever was in the file.

use retargetd::{
    formats::{self, Limits},
    model::{Clip, Control, Scene, Track},
};

/// # Panics
/// When an index points nowhere or a number is none.
pub(super) fn scene(scene: &Scene) {
    let joints = scene.skeleton.len();
    for (index, joint) in scene.skeleton.joints().iter().enumerate() {
        assert!(joint.rest.is_finite(), "joint {index} rests at a finite place");
        assert!(joint.parent.is_none_or(|parent| parent < index), "parents come before joint {index}");
    }
    for clip in &scene.clips {
        check_clip(clip, scene);
    }
    for skin in &scene.skins {
        assert!(skin.joints.iter().all(|joint| *joint < joints), "skins bind joints that are there");
    }
    assert!(scene.bind_pose.is_empty() || scene.bind_pose.len() == joints, "one place in the bind pose for each joint");
    assert!(scene.bind_pose.iter().flatten().all(|bind| bind.is_finite()), "a finite bind pose");
    assert!(scene.declared_roles.iter().all(|(_, joint)| *joint < joints), "roles of joints that are there");
    assert!(scene.gaze_joint.is_none_or(|joint| joint < joints), "a gaze of a joint that is there");
    assert!(scene.unit_meters.is_none_or(|unit| unit.is_finite() && unit > 0.0), "a unit that is one");
    assert!(scene.morphs.iter().all(|morph| morph.rest.is_finite()), "finite weights at rest");
    // What meshes hold is looked at later than the rest; it may be as broken.
    if let Ok(meshes) = formats::morph_meshes(scene, &Limits::default(), &Control::new()) {
        assert!(meshes.len() <= scene.morphs.len(), "meshes of morphs that are there");
    }
}

fn check_clip(clip: &Clip, scene: &Scene) {
    let (frames, joints) = (clip.frame_count(), scene.skeleton.len());
    assert_eq!(clip.joints().len(), joints, "one set of tracks for each joint");
    assert!(clip.times_seconds().iter().all(|time| time.is_finite()), "finite times");
    assert!(clip.times_seconds().is_sorted_by(|before, after| before < after), "times that rise");
    for tracks in clip.joints() {
        assert!(
            holds(&tracks.translation, frames, |value| value.is_finite()),
            "finite translations, one for each frame"
        );
        assert!(holds(&tracks.rotation, frames, |value| value.is_normalized()), "unit rotations, one for each frame");
        assert!(holds(&tracks.scale, frames, |value| value.is_finite()), "finite scales, one for each frame");
    }
    for morph in clip.morphs() {
        assert!(morph.morph < scene.morphs.len(), "weights of a morph that is there");
        assert!(holds(&morph.weights, frames, |value| value.is_finite()), "finite weights, one for each frame");
    }
    for contact in clip.contacts() {
        assert!(contact.joint < joints && contact.touches.len() == frames, "contacts of a joint, one for each frame");
    }
}

fn holds<T>(track: &Track<T>, frames: usize, is_good: impl Fn(&T) -> bool) -> bool {
    match track {
        Track::Rest => true,
        Track::Constant(value) => is_good(value),
        Track::Sampled(values) => values.len() == frames && values.iter().all(is_good),
    }
}
