//! Faces: names that meet, formulas by a hand-checked table, files through the engine.

use std::collections::BTreeMap;

use retargetd::{
    engine::{self, EditInputs, Inputs, Limits, NamedBytes},
    model::{Clip, Control, Morph, MorphPlace, MorphTrack, Scene, Track},
    rig::{MorphCombine, MorphMapping, MorphRow, MorphsSpec, map_morphs},
};
use serde_json::{Value, json};

use crate::support::corpus_file;

fn shape(name: &str) -> Morph {
    Morph { name: name.into(), rest: 0.0, place: MorphPlace::Mesh { node: 0, index: 0, count: 1 } }
}

/// Expressions of an avatar, all bound to the shape that comes first.
fn avatar(expressions: &[&str]) -> Vec<Morph> {
    let expression = |name: &&str| Morph { place: MorphPlace::Expression(vec![(0, 1.0)]), ..shape(name) };
    [shape("face")].into_iter().chain(expressions.iter().map(expression)).collect()
}

/// What the target's morphs become for weights of the source's.
fn weights(weights: &[(&str, f64)], target: &[Morph], spec: &MorphsSpec) -> BTreeMap<String, f64> {
    let source: Vec<Morph> = weights.iter().map(|(name, _)| shape(name)).collect();
    let animated: Vec<usize> = (0..source.len()).collect();
    let mapping = map_morphs(&source, &animated, target, spec).expect("a mapping");
    let weight = |drive: &retargetd::rig::MorphDrive| {
        let value = drive.weight(|morph| weights[morph].1);
        (target[drive.target].name.clone(), (value * 1e6).round() / 1e6)
    };
    mapping.drives.iter().map(weight).collect()
}

#[test]
fn arkit_becomes_vrm_expressions_by_the_documented_table() {
    let vrm = avatar(&[
        "aa",
        "ih",
        "ou",
        "ee",
        "oh",
        "happy",
        "angry",
        "sad",
        "surprised",
        "blinkLeft",
        "blinkRight",
        "lookUp",
        "lookLeft",
    ]);
    let clip = [
        ("eyeBlinkLeft", 0.8),
        ("eyeBlinkRight", 0.2),
        ("jawOpen", 0.5),
        ("mouthFunnel", 0.25),
        ("mouthPucker", 0.5),
        ("mouthStretchLeft", 0.2),
        ("mouthStretchRight", 0.4),
        ("mouthSmileLeft", 0.6),
        ("mouthSmileRight", 0.4),
        ("cheekSquintLeft", 0.2),
        ("cheekSquintRight", 0.4),
        ("browDownLeft", 0.1),
        ("browDownRight", 0.3),
        ("noseSneerLeft", 0.2),
        ("noseSneerRight", 0.2),
        ("mouthFrownLeft", 0.2),
        ("mouthFrownRight", 0.6),
        ("browInnerUp", 0.6),
        ("eyeWideLeft", 0.4),
        ("eyeWideRight", 0.6),
        ("browOuterUpLeft", 0.3),
        ("browOuterUpRight", 0.7),
        ("eyeLookUpLeft", 0.3),
        ("eyeLookUpRight", 0.5),
        ("eyeLookOutLeft", 0.2),
        ("eyeLookInRight", 0.4),
    ];
    // By hand, from the formulas of the documentation.
    let expected = [
        ("aa", 0.275),      // 0.5 · (1 − 0.6 · 0.25 − 0.6 · 0.5)
        ("ih", 0.15),       // 0.3 · (1 − 0.5)
        ("ou", 0.5),        // the pucker
        ("ee", 0.25),       // 2 · 0.5 · 0.5 · (1 − 0.5)
        ("oh", 0.25),       // 2 · 0.25 · 0.5
        ("happy", 0.4),     // mean of 0.6 0.4 0.2 0.4
        ("angry", 0.2),     // mean of 0.1 0.3 0.2 0.2
        ("sad", 0.5),       // mean of 0.4, the frown, and 0.6
        ("surprised", 0.5), // mean of 0.5, the eyes, 0.5, the brows, and 0.5
        ("blinkLeft", 0.8),
        ("blinkRight", 0.2),
        ("lookUp", 0.4),
        ("lookLeft", 0.3),
    ];
    let expected: BTreeMap<String, f64> =
        expected.into_iter().map(|(name, weight)| (name.to_owned(), weight)).collect();
    assert_eq!(weights(&clip, &vrm, &MorphsSpec::default()), expected);

    let one_lid = avatar(&["blink"]);
    let blink = weights(&clip, &one_lid, &MorphsSpec::default());
    assert_eq!(blink["blink"], 0.2, "both lids only close as far as both do");
    let three = avatar(&["blink", "blinkLeft", "blinkRight"]);
    assert!(!weights(&clip, &three, &MorphsSpec::default()).contains_key("blink"), "lids close once");
}

#[test]
fn avatars_with_the_shapes_of_arkit_take_them_as_they_are() {
    let mut perfect = avatar(&["blinkLeft", "aa"]);
    perfect.extend([shape("EyeBlink_L"), shape("CTRL_expressions_jawOpen"), shape("A38_Mouth_Smile_Left")]);
    let clip = [("eyeBlinkLeft", 0.8), ("jawOpen", 0.5), ("mouthSmileLeft", 1.2)];
    let expected: BTreeMap<String, f64> =
        [("EyeBlink_L", 0.8), ("CTRL_expressions_jawOpen", 0.5), ("A38_Mouth_Smile_Left", 1.2)]
            .map(|(name, weight)| (name.to_owned(), weight))
            .into();
    assert_eq!(weights(&clip, &perfect, &MorphsSpec::default()), expected, "no expression on top");
}

/// Visemes are met by name, and the lids and eyes beside them are still made of what ARKit says.
#[test]
fn a_face_that_speaks_in_visemes_blinks_and_looks_on() {
    let face = avatar(&["aa", "oh", "blink", "happy", "lookUp"]);
    let clip = [
        ("viseme_aa", 0.4),
        ("jawOpen", 0.5),
        ("mouthSmileLeft", 0.6),
        ("eyeBlinkLeft", 0.8),
        ("eyeBlinkRight", 0.2),
        ("eyeLookUpLeft", 0.3),
        ("eyeLookUpRight", 0.5),
    ];
    let expected: BTreeMap<String, f64> =
        [("aa", 0.4), ("blink", 0.2), ("lookUp", 0.4)].map(|(name, weight)| (name.to_owned(), weight)).into();
    assert_eq!(weights(&clip, &face, &MorphsSpec::default()), expected, "and the mouth moves once");
    let mut with_lids = avatar(&["aa", "blinkLeft"]);
    with_lids.push(shape("eyeBlinkLeft"));
    let found = weights(&clip, &with_lids, &MorphsSpec::default());
    assert!(found.contains_key("eyeBlinkLeft") && !found.contains_key("blinkLeft"), "lids close once: {found:?}");
}

#[test]
fn consonants_become_what_the_documented_table_says() {
    let speech = [
        ("viseme_sil", 0.3),
        ("viseme_PP", 0.5),
        ("viseme_FF", 0.4),
        ("viseme_TH", 0.2),
        ("viseme_DD", 0.6),
        ("viseme_kk", 0.8),
        ("viseme_CH", 0.5),
        ("viseme_SS", 0.4),
        ("viseme_nn", 0.1),
        ("viseme_RR", 1.0),
        ("viseme_aa", 0.2),
    ];
    // By hand, from the table of the documentation.
    let arkit = [
        ("jawOpen", 0.58), // 0.7 · 0.2 + 0.15 · (0.2 + 0.6) + 0.2 · 0.8 + 0.1 · (0.1 + 1 + 0.5)
        ("mouthPucker", 0.3),
        ("mouthFunnel", 0.65),
        ("mouthStretchLeft", 0.36),
        ("mouthPressRight", 0.4),
        ("mouthRollLower", 0.43),
        ("mouthRollUpper", 0.15),
        ("mouthUpperUpLeft", 0.12),
        ("mouthLowerDownRight", 0.32),
        ("mouthShrugUpper", 0.1),
        ("tongueOut", 0.08),
    ];
    let face: Vec<Morph> = arkit.iter().map(|(name, _)| shape(name)).collect();
    let expected: BTreeMap<String, f64> = arkit.map(|(name, weight)| (name.to_owned(), weight)).into();
    assert_eq!(weights(&speech, &face, &MorphsSpec::default()), expected, "ARKit's shapes");

    let vrm = [
        ("aa", 0.38), // its own 0.2, and 0.15 · 0.8 + 0.1 · 0.6
        ("ih", 0.63), // 0.2 · (0.4 + 0.8) + 0.3 · (0.2 + 0.6 + 0.4 + 0.1)
        ("ou", 0.5),  // 0.4 · 0.5 + 0.3 · 1
        ("ee", 0.08),
    ];
    let expected: BTreeMap<String, f64> = vrm.map(|(name, weight)| (name.to_owned(), weight)).into();
    let avatar = avatar(&["aa", "ih", "ou", "ee", "oh"]);
    assert_eq!(weights(&speech, &avatar, &MorphsSpec::default()), expected, "a VRM's vowels");

    let shapes = [
        ("mouthPressLeft", 0.4),
        ("mouthPressRight", 0.2),
        ("mouthRollLower", 0.6),
        ("mouthRollUpper", 0.2),
        ("tongueOut", 0.3),
        ("mouthFunnel", 0.8),
        ("jawOpen", 0.25),
    ];
    let visemes = [
        ("viseme_PP", 0.35),  // half of (0.2 + 0.1 + 0.3 + 0.1)
        ("viseme_FF", 0.336), // 0.6 · (1 − 0.2) · (1 − 0.3)
        ("viseme_TH", 0.3),
        ("viseme_CH", 0.6), // 0.8 · (1 − 0.25)
    ];
    let mouth: Vec<Morph> = visemes.iter().map(|(name, _)| shape(name)).chain([shape("viseme_kk")]).collect();
    let expected: BTreeMap<String, f64> = visemes.map(|(name, weight)| (name.to_owned(), weight)).into();
    assert_eq!(weights(&shapes, &mouth, &MorphsSpec::default()), expected, "visemes from ARKit's shapes");
}

#[test]
fn rows_say_what_follows_what() {
    let row = |source: &str, gain: f64, offset: f64, combine: MorphCombine| MorphRow {
        source: source.into(),
        target: "open".into(),
        gain,
        offset,
        clamp: [0.0, 1.0],
        combine,
    };
    let clip = [("jawOpen", 0.5), ("tongueOut", 0.3)];
    let target = [shape("open"), shape("other")];
    for (combine, wanted) in
        [(MorphCombine::Sum, 0.9), (MorphCombine::Max, 0.6), (MorphCombine::Min, 0.3), (MorphCombine::Product, 0.18)]
    {
        let rows = vec![row("jawOpen", 1.0, 0.1, combine), row("tongueOut", 1.0, 0.0, combine)];
        let made = weights(&clip, &target, &MorphsSpec { rows, ..MorphsSpec::default() });
        assert_eq!(made, BTreeMap::from([("open".to_owned(), wanted)]), "{combine:?}");
    }
    let rows = vec![row("jawOpen", 10.0, 0.0, MorphCombine::Sum)];
    assert_eq!(weights(&clip, &target, &MorphsSpec { rows, ..MorphsSpec::default() })["open"], 1.0, "clamped");
    let rows = vec![row("jawOpn", 1.0, 0.0, MorphCombine::Sum)];
    let spec = MorphsSpec { rows, ..MorphsSpec::default() };
    let error = map_morphs(&[shape("jawOpen")], &[0], &target, &spec).expect_err("no such morph");
    assert_eq!((error.fields[0].pointer.as_str(), error.fields[0].did_you_mean.len()), ("/morphs/rows/0/source", 1));
    let off = MorphsSpec { enabled: false, ..MorphsSpec::default() };
    let mapping = map_morphs(&[shape("open")], &[0], &target, &off).expect("a mapping");
    assert_eq!(mapping, MorphMapping { drives: Vec::new(), unused: vec![0] }, "switched off");
}

fn read(bytes: &[u8], name: &str) -> Scene {
    crate::quality::figure::read_scene(bytes, name)
}

/// The weights of the first morph of that name in the first clip; of its first frames where there are more.
fn track(scene: &Scene, name: &str) -> Option<Vec<f32>> {
    let clip = &scene.clips[0];
    let found = clip.morphs().iter().find(|track| scene.morphs[track.morph].name == name)?;
    Some((0..clip.frame_count()).map(|frame| found.weights.at(frame, 0.0)).collect())
}

/// A Ready Player Me avatar, its shapes called otherwise: old names and new.
fn renamed(names: &[(&str, &str)]) -> Option<Vec<u8>> {
    let bytes = std::fs::read(corpus_file("readyplayerme/rpm_avatar_a.glb")?).expect("the avatar");
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    let mut document: Value = serde_json::from_slice(&bytes[20..20 + length]).expect("JSON");
    for mesh in document["meshes"].as_array_mut().expect("meshes") {
        for place in [mesh["extras"]["targetNames"].take(), mesh["primitives"][0]["extras"]["targetNames"].take()] {
            let Value::Array(mut targets) = place else { continue };
            for target in &mut targets {
                if let Some((_, new)) = names.iter().find(|(old, _)| *target == json!(old)) {
                    *target = json!(new);
                }
            }
            mesh["extras"] = json!({"targetNames": targets});
        }
    }
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &bytes[20 + length..];
    let mut renamed = bytes[..8].to_vec();
    renamed.extend(((20 + text.len() + rest.len()) as u32).to_le_bytes());
    renamed.extend((text.len() as u32).to_le_bytes());
    renamed.extend(&bytes[16..20]);
    renamed.extend(text);
    renamed.extend(rest);
    Some(renamed)
}

/// That avatar saying something with these shapes.
pub(crate) fn speaking(names: &[(&str, &str)]) -> Option<Vec<u8>> {
    let renamed = renamed(names)?;
    let scene = read(&renamed, "avatar.glb");
    let morphs = (0..scene.morphs.len()).filter(|morph| names.iter().any(|(_, new)| *new == scene.morphs[*morph].name));
    let rising =
        |morph| MorphTrack { morph, weights: Track::Sampled((0..=10).map(|frame| frame as f32 / 10.0).collect()) };
    let tracks = vec![retargetd::model::JointTracks::default(); scene.skeleton.len()];
    let clip = Clip::new("speech".into(), (0..=10).map(|frame| f64::from(frame) / 30.0).collect(), tracks);
    let clip = clip.and_then(|clip| clip.with_morphs(morphs.map(rising).collect())).expect("a clip");
    let options = retargetd::formats::WriteOptions {
        target_clips: retargetd::formats::TargetClips::Drop,
        ..retargetd::formats::WriteOptions::new(engine::Format::Glb)
    };
    let mut reporter = retargetd::model::Reporter::new();
    Some(retargetd::formats::write(&scene, &clip, &options, &Control::new(), &mut reporter).expect("it is written"))
}

fn onto_vrm(source: &[u8], config: &Value) -> Option<engine::Outcome> {
    let target = std::fs::read(corpus_file("vrm0/godette.vrm")?).expect("the avatar");
    Some(onto(source, NamedBytes { name: "godette.vrm", bytes: &target }, config).expect("an outcome"))
}

fn onto(source: &[u8], target: NamedBytes<'_>, config: &Value) -> Result<engine::Outcome, engine::Failure> {
    let config = config.to_string();
    let inputs = Inputs {
        source: NamedBytes { name: "speaking.glb", bytes: source },
        target,
        source_rest: None,
        target_rest: None,
        config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
        formats: &[],
    };
    engine::retarget(&inputs, &Limits::default(), &Control::new())
}

const SPEECH: [(&str, &str); 2] = [("viseme_aa", "viseme_aa"), ("viseme_O", "viseme_O")];

#[test]
fn a_face_is_fitted_by_what_its_meshes_do() {
    // The same avatar with names that say nothing: what each shape does says it all.
    let names = [("viseme_aa", "one"), ("viseme_O", "two"), ("viseme_PP", "three"), ("viseme_E", "four")];
    let (Some(source), Some(target)) = (speaking(&SPEECH), renamed(&names)) else { return };
    let target = NamedBytes { name: "avatar.glb", bytes: &target };
    let outcome = onto(&source, target, &json!({"morphs": {"fit": {}}})).expect("an outcome");
    let view = outcome.report.face_fit.expect("it was fitted");
    assert!(view.same_topology && view.missed_share < 0.02, "{view:?}");
    let made = read(&outcome.outputs[0].bytes, "out.glb");
    for (shape, rises) in [("one", true), ("two", true), ("three", false), ("four", false)] {
        let weights = track(&made, shape).unwrap_or_else(|| vec![0.0; 11]);
        let wanted = |frame: usize| if rises { frame as f32 / 10.0 } else { 0.0 };
        let error = weights.iter().enumerate().map(|(frame, weight)| (weight - wanted(frame)).abs());
        assert!(error.fold(0.0, f32::max) < 0.03, "'{shape}': {weights:?}");
    }
    let config = json!({"morphs": {"fit": {}, "rows": [{"source": "viseme_aa", "target": "three", "gain": 0.5}]}});
    let with_row = onto(&source, target, &config).expect("an outcome");
    let three = track(&read(&with_row.outputs[0].bytes, "out.glb"), "three").expect("its row moves it");
    assert!((three[10] - 0.5).abs() < 1e-6, "rows count: {three:?}");
}

#[test]
fn faces_that_cannot_do_the_same_go_by_names() {
    // A scanned face, and a drawn one of a third of its vertices whose mouth is elsewhere.
    let Some(source) = speaking(&SPEECH) else { return };
    let Some(outcome) = onto_vrm(&source, &json!({"morphs": {"fit": {}}})) else { return };
    let told = outcome.report.warnings.iter().find(|warning| warning.code == "morphs_fit_impossible").expect("a word");
    assert!(told.detail.contains(" % of what the source's face does"), "{}", told.detail);
    let by_name = track(&read(&outcome.outputs[0].bytes, "out.glb"), "ah").expect("an open mouth");
    assert!((by_name[10] - 1.0).abs() < 1e-6, "as without a fit: {by_name:?}");
}

#[test]
fn what_cannot_be_fitted_is_said_and_goes_by_names() {
    let Some(source) = speaking(&SPEECH) else { return };
    let mannequin = retargetd::samples::mannequin();
    let target = NamedBytes { name: "mannequin.glb", bytes: &mannequin };
    let outcome = onto(&source, target, &json!({"morphs": {"fit": {}}})).expect("an outcome");
    let codes: Vec<&str> = outcome.report.warnings.iter().map(|warning| warning.code).collect();
    assert!(codes.contains(&"morphs_fit_impossible") && codes.contains(&"morphs_lost"), "{codes:?}");
    assert_eq!(outcome.report.face_fit, None);
    let failure = onto(&source, target, &json!({"morphs": {"fit": {"bounds": [0.5, 1.0]}}})).expect_err("no bounds");
    assert_eq!(failure.errors[0].pointer, "/morphs/fit/bounds", "{failure:?}");
}

#[test]
fn a_speaking_avatar_makes_a_vrm_speak() {
    let Some(source) = speaking(&SPEECH) else { return };
    let Some(outcome) = onto_vrm(&source, &json!({})) else { return };
    let made = read(&outcome.outputs[0].bytes, "out.glb");
    for shape in ["ah", "oh"] {
        let weights = track(&made, shape).unwrap_or_else(|| panic!("'{shape}' moves"));
        let error = weights.iter().enumerate().map(|(frame, weight)| (weight - frame as f32 / 10.0).abs());
        assert!(error.fold(0.0, f32::max) < 1e-6, "'{shape}' follows its viseme: {weights:?}");
    }
    assert_eq!(track(&made, "ih").map(|weights| weights[10]), Some(0.0), "what nothing moves stays");
    let off = onto_vrm(&source, &json!({"morphs": {"enabled": false}})).expect("an outcome");
    assert!(read(&off.outputs[0].bytes, "out.glb").clips[0].morphs().is_empty(), "switched off");
}

#[test]
fn an_arkit_clip_onto_a_vrm_avatar() {
    let names = [
        ("viseme_PP", "eyeBlinkLeft"),
        ("viseme_FF", "jawOpen"),
        ("viseme_TH", "mouthFunnel"),
        ("viseme_DD", "tongueOut"),
    ];
    let Some(source) = speaking(&names) else { return };
    let Some(outcome) = onto_vrm(&source, &json!({})) else { return };
    let made = read(&outcome.outputs[0].bytes, "out.glb");
    let blink = track(&made, "blink_left").expect("a blink");
    assert!((blink[8] - 0.8).abs() < 1e-6, "the left lid: {blink:?}");
    let open = track(&made, "ah").expect("an open mouth");
    assert!((open[5] - 0.5 * (1.0 - 0.6 * 0.5)).abs() < 1e-6, "aa of the table: {open:?}");
    let lost = outcome.report.warnings.iter().find(|warning| warning.code == "morphs_lost").expect("a loss");
    assert!(lost.detail.contains("tongueOut"), "what is lost is named: {}", lost.detail);
}

#[test]
fn faces_go_along_with_edits() {
    let Some(path) = corpus_file("cc0-stylised/robot_expressive.glb") else { return };
    let bytes = std::fs::read(path).expect("the robot");
    let edit = |config: Value| {
        let config = config.to_string();
        let inputs = EditInputs {
            source: NamedBytes { name: "robot.glb", bytes: &bytes },
            source_rest: None,
            unread_target: false,
            config: Some(NamedBytes { name: "config.json", bytes: config.as_bytes() }),
            formats: &[],
        };
        let outcome = engine::edit(&inputs, &Limits::default(), &Control::new()).expect("an outcome");
        read(&outcome.outputs[0].bytes, "out.glb")
    };
    let own = read(&bytes, "robot.glb");
    let moving =
        own.clips.iter().find(|clip| clip.morphs().iter().any(|track| matches!(&track.weights, Track::Sampled(_))));
    let Some(moving) = moving else { return };
    let plain = edit(json!({"clip": moving.name()}));
    assert_eq!(plain.clips[0].morphs(), moving.morphs(), "nothing asked for, nothing changed");
    let back = edit(json!({"clip": moving.name(), "edit": {"reverse": true}}));
    for (track, other) in moving.morphs().iter().zip(back.clips[0].morphs()) {
        let frames = moving.frame_count();
        for frame in 0..frames {
            let (one, two) = (track.weights.at(frame, 0.0), other.weights.at(frames - 1 - frame, 0.0));
            assert!((one - two).abs() < 1e-5, "frame {frame} from the other end: {one}, {two}");
        }
    }
}
