//! VRM animations that we write, played by three-vrm on real avatars and read by ourselves.

use std::fs;

use retargetd::engine::Format;

use super::{Axes, MAX_DEGREES, MAX_OF_SIZE, Written, blender, retargeted, three};
use crate::{
    morphs::speaking,
    support::{corpus_file, validate_gltf},
};

const CLIP: &str = "mixamo/gltf/Xbot.glb";
const AVATARS: [&str; 4] = [
    "vrm1/makehuman_body_vrm1.vrm",
    "vrm1/basic_armature_vrm1.vrm",
    "vrm0/makehuman_body_vrm0.vrm",
    "vrm0/godette.vrm",
];
const CONFIG: &str = r#"{"clip": "walk"}"#;

#[test]
fn avatars_play_what_was_made_for_them() {
    let Some(source) = corpus_file(CLIP) else { return };
    let source = fs::read(source).expect("a file");
    let folder = tempfile::tempdir().expect("a folder");
    let (mut written, mut plays) = (Vec::new(), Vec::new());
    for (index, avatar) in AVATARS.iter().enumerate() {
        let Some(path) = corpus_file(avatar) else { return };
        let bytes = fs::read(&path).expect("a file");
        let outcome = retargeted((CLIP, &source), (avatar, &bytes), CONFIG, &[Format::Vrm, Format::Vrma]);
        let file = folder.path().join(format!("{index}.vrma"));
        fs::write(&file, &outcome.outputs[1].bytes).expect("a file");
        plays.push(format!("{}={}", file.display(), path.display()));
        written.push((file, Written::of(&outcome.outputs[0].bytes, "out.vrm")));
    }
    let files: Vec<_> = written.iter().map(|(file, _)| file.as_path()).collect();
    if let Some(reports) = validate_gltf(&files) {
        for report in reports.values() {
            assert_eq!((report["errors"].as_u64(), report["warnings"].as_u64()), (Some(0), Some(0)), "{report}");
        }
    }
    let Some(answers) = three::read(&plays) else { return };
    for (((_, ours), seen), avatar) in written.iter().zip(&answers).zip(AVATARS) {
        let scene = &ours.scene;
        let bone = |joint: usize| scene.declared_roles.iter().find(|(_, declared)| *declared == joint);
        let apart = ours.apart(seen, 1.0, Axes::Same, |joint| {
            let (role, _) = bone(joint)?;
            (!role.ends_with("Eye")).then(|| scene.skeleton.joints()[joint].name.clone())
        });
        assert!(apart.joints > 15, "{avatar}: {apart:?}");
        assert!(apart.size < MAX_OF_SIZE && apart.degrees < MAX_DEGREES, "{avatar}: {apart:?}");
    }
}

/// Animations of the first two avatars, in whole frames at the times that readers are asked for, and what we read in them.
struct Animations {
    _folder: tempfile::TempDir,
    paths: Vec<String>,
    written: Vec<Written>,
}

impl Animations {
    fn new() -> Option<Self> {
        let source = fs::read(corpus_file(CLIP)?).expect("a file");
        let folder = tempfile::tempdir().expect("a folder");
        let (mut paths, mut written) = (Vec::new(), Vec::new());
        for (index, avatar) in AVATARS[..2].iter().enumerate() {
            let bytes = fs::read(corpus_file(avatar)?).expect("a file");
            let config = r#"{"clip": "walk", "edit": {"fps": 30, "range": [0, 0.8]}}"#;
            let outcome = retargeted((CLIP, &source), (avatar, &bytes), config, &[Format::Vrma]);
            let path = folder.path().join(format!("{index}.vrma"));
            fs::write(&path, &outcome.outputs[0].bytes).expect("a file");
            paths.push(path.display().to_string());
            written.push(Written::of(&outcome.outputs[0].bytes, "out.vrma"));
        }
        Some(Self { _folder: folder, paths, written })
    }

    fn judge(&self, answers: &[serde_json::Value], axes: Axes) {
        for (ours, seen) in self.written.iter().zip(answers) {
            let apart = ours.apart(seen, 1.0, axes, |joint| {
                let is_bone = ours.scene.declared_roles.iter().any(|(_, bone)| *bone == joint);
                is_bone.then(|| ours.scene.skeleton.joints()[joint].name.clone())
            });
            assert!(apart.joints > 15, "{apart:?}");
            assert!(apart.size < MAX_OF_SIZE && apart.degrees < MAX_DEGREES, "{apart:?}");
        }
    }
}

#[test]
fn three_reads_animations_as_scenes() {
    let Some(animations) = Animations::new() else { return };
    let Some(answers) = three::read(&animations.paths) else { return };
    animations.judge(&answers, Axes::Same);
}

#[test]
fn blender_reads_animations_as_scenes() {
    let Some(animations) = Animations::new() else { return };
    let Some(answers) = blender::read(&animations.paths) else { return };
    animations.judge(&answers, Axes::Own);
}

/// A face that opens its mouth and blinks, onto an avatar, as a VRM animation: three-vrm gives the avatar's expressions the weights
/// that we read in the file, and a retarget of that file gives them to the avatar again.
#[test]
fn faces_come_out_of_animations_as_they_went_in() {
    const AVATAR: &str = "vrm0/godette.vrm";
    let shapes = [("viseme_aa", "jawOpen"), ("viseme_PP", "eyeBlinkLeft")];
    let Some((source, avatar)) = speaking(&shapes).zip(corpus_file(AVATAR)) else { return };
    let bytes = fs::read(&avatar).expect("a file");
    let outcome = retargeted(("speaking.glb", &source), (AVATAR, &bytes), "{}", &[Format::Vrma]);
    let animation = &outcome.outputs[0].bytes;
    let ours = Written::of(animation, "out.vrma");
    let weight = |ours: &Written, name: &str, seconds: f64| {
        let track = ours.clip.morphs().iter().find(|track| ours.scene.morphs[track.morph].name == name);
        let track = track.unwrap_or_else(|| panic!("'{name}' moves, among {:?}", ours.scene.morphs));
        let frame = ours.clip.times_seconds().iter().position(|time| (time - seconds).abs() < 1e-6);
        frame.map(|frame| f64::from(track.weights.at(frame, 0.0)))
    };
    let last = ours.clip.duration_seconds();
    assert!(weight(&ours, "aa", last).is_some_and(|weight| weight > 0.9), "the mouth is open at the end");
    assert!(weight(&ours, "blinkLeft", last).is_some_and(|weight| weight > 0.9), "and the left eye closed");

    let again = retargeted(("out.vrma", animation), (AVATAR, &bytes), "{}", &[Format::Vrm]);
    let worn = Written::of(&again.outputs[0].bytes, "out.vrm");
    for (expression, shape) in [("aa", "ah"), ("blinkLeft", "blink_left")] {
        for time in ours.clip.times_seconds() {
            let (given, taken) = (weight(&ours, expression, *time), weight(&worn, shape, *time));
            assert!(
                given.zip(taken).is_some_and(|(one, other)| (one - other).abs() < 1e-5),
                "{shape}: {given:?}, {taken:?}"
            );
        }
    }

    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("speech.vrma");
    fs::write(&file, animation).expect("a file");
    let Some(answers) = three::read(&[format!("{}={}", file.display(), avatar.display())]) else { return };
    let times = answers[0]["times"].as_array().expect("times").iter().filter_map(serde_json::Value::as_f64);
    let mut compared = 0;
    for (index, time) in times.enumerate() {
        for name in ["aa", "blinkLeft"] {
            let Some(expected) = weight(&ours, name, time) else { continue };
            let found = answers[0]["expressions"][name][index].as_f64().expect("a weight");
            assert!((found - expected).abs() < 1e-4, "{name} at {time} s: {found}, not {expected}");
            compared += 1;
        }
    }
    assert!(compared >= 4, "at least both ends: {compared}");
}

/// A shape that moves beside the expressions and that none of them shows: it is said that it is not there.
#[test]
fn shapes_that_no_expression_shows_are_named() {
    const AVATAR: &str = "vrm0/godette.vrm";
    let shapes = [("viseme_aa", "viseme_aa"), ("viseme_PP", "blush")];
    let Some((source, avatar)) = speaking(&shapes).zip(corpus_file(AVATAR)) else { return };
    let bytes = fs::read(&avatar).expect("a file");
    let config = r#"{"morphs": {"rows": [{"source": "blush", "target": "HideBlush"}]}}"#;
    let outcome = retargeted(("speaking.glb", &source), (AVATAR, &bytes), config, &[Format::Vrma]);
    let names: Vec<String> = Written::of(&outcome.outputs[0].bytes, "out.vrma")
        .scene
        .morphs
        .iter()
        .map(|morph| morph.name.clone())
        .collect();
    assert_eq!(names, ["aa"]);
    let told = outcome.report.warnings.iter().find(|warning| warning.code == "morphs_not_written").expect("a word");
    assert!(told.detail.contains("HideBlush"), "{}", told.detail);
}
