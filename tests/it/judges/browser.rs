//! Pictures, as three.js in headless Chromium draws the same figures with the same camera, and as Chromium plays them.

use std::{path::Path, process::Command};

use rayon::prelude::*;
use retargetd::{
    engine::{Background, CameraKind, Format, Limits, NamedBytes, PreviewOptions, Style, View, preview},
    model::Control,
    samples,
};
use serde_json::{Value, json};

use super::retargeted;
use crate::support::{browser_script, corpus_file, gltf_json};

/// Characters with skins of one and several meshes, morphs, more than four joints a vertex, compressed vertices, and parts without a skin.
const CHARACTERS: [&str; 21] = [
    "cc0-stylised/kaykit_knight.glb",
    "cc0-stylised/robot_expressive.glb",
    "cmu-rig/makehuman_cmu_names_rest.glb",
    "creatures/Fox.glb",
    "khronos/CesiumMan.glb",
    "mixamo/gltf/Soldier.glb",
    "mixamo/gltf/Xbot.glb",
    "mixamo/gltf/joe_meshopt_9skins.glb",
    "mixamo/gltf/michelle_meshopt.glb",
    "mixamo/gltf/mousey_meshopt.glb",
    "odd-transforms/armature_nonuniform_scale.glb",
    "odd-transforms/armature_rotated_offset_001.glb",
    "poser-daz/daz_g8_names_apose.glb",
    "readyplayerme/rpm_avatar_a.glb",
    "unreal/m2m_human_male.glb",
    "unreal/mannequiny.glb",
    "unreal/ue4_names_apose.glb",
    "vrm0/catbot.vrm",
    "vrm0/cryptovoxels.vrm",
    "vrm0/godette.vrm",
    "vrm1/makehuman_body_vrm1.vrm",
];
const FRAMES: usize = 5;
const SIZE: [usize; 2] = [512, 512];
const MIN_OVERLAP: f64 = 0.98;

/// The file as it is where its first clip moves it, otherwise with the sample walk on it; and how long its first clip is.
fn moving(path: &Path) -> (Vec<u8>, f64) {
    let bytes = std::fs::read(path).expect("readable");
    let lasts = |bytes: &[u8]| {
        let document = gltf_json(bytes);
        let samplers = document["animations"][0]["samplers"].as_array().cloned().unwrap_or_default();
        let inputs = samplers.iter().filter_map(|sampler| sampler["input"].as_u64());
        let last = |input: u64| document["accessors"][input as usize]["max"][0].as_f64();
        inputs.filter_map(last).fold(0.0, f64::max)
    };
    let seconds = lasts(&bytes);
    if seconds > 0.2 {
        return (bytes, seconds);
    }
    let name = path.file_name().expect("a name").to_string_lossy();
    let walk = samples::walk_clip();
    let outcome = retargeted(("walk.glb", &walk), (&name, &bytes), "{}", &[Format::Glb]);
    let bytes = outcome.outputs.into_iter().next().expect("a file").bytes;
    let seconds = lasts(&bytes);
    (bytes, seconds)
}

/// What the page is asked: a file of the folder, and pictures of it that lie there too.
fn task(path: &Path, folder: &Path) -> Value {
    let (bytes, seconds) = moving(path);
    let name = path.file_stem().expect("a name").to_string_lossy();
    let file = folder.join(format!("{name}.glb"));
    std::fs::write(&file, &bytes).expect("written");
    let cameras =
        [CameraKind::Front, CameraKind::ThreeQuarter, CameraKind::Side, CameraKind::Back, CameraKind::Top].into_iter();
    let pictures = (0..FRAMES).zip(cameras).map(|(frame, camera)| {
        let at_seconds = seconds * frame as f64 / (FRAMES - 1) as f64;
        let view = View {
            size: SIZE,
            camera,
            at_seconds: Some(at_seconds),
            style: Style::Silhouette,
            background: Background::Dark,
            ..View::default()
        };
        let clip = gltf_json(&bytes)["animations"][0]["name"].as_str().map(str::to_owned);
        let options = PreviewOptions { view, ending: "png".to_owned(), clip };
        let named = NamedBytes { name: "figure.glb", bytes: &bytes };
        let picture = preview(named, &options, &Limits::default(), &Control::new())
            .unwrap_or_else(|failure| panic!("{}: {failure}", path.display()));
        let silhouette = folder.join(format!("{name}-{frame}.png"));
        std::fs::write(&silhouette, &picture.bytes).expect("written");
        let sight = picture.sights[0];
        let [right, up, back] = sight.axes.map(|axis| axis.to_array());
        json!({
            "seconds": at_seconds, "eye": sight.eye.to_array(), "right": right, "up": up, "back": back,
            "vertical_degrees": sight.vertical_degrees, "silhouette": silhouette,
        })
    });
    json!({"file": file, "pictures": pictures.collect::<Vec<_>>()})
}

#[test]
fn silhouettes_are_those_of_a_browser() {
    let Some(script) = browser_script("silhouettes.mjs") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let Some(paths) = CHARACTERS.iter().map(|path| corpus_file(path)).collect::<Option<Vec<_>>>() else { return };
    let tasks: Vec<Value> = paths.par_iter().map(|path| task(path, folder.path())).collect();
    let list = folder.path().join("list.json");
    std::fs::write(&list, serde_json::to_vec(&tasks).expect("JSON")).expect("written");
    let output = Command::new("node").arg(script).arg(&list).output().expect("node runs");
    let answers = super::answers(&output, CHARACTERS.len()).expect("an answer for each");
    let mut wrong = Vec::new();
    for answer in &answers {
        let overlaps: Vec<f64> =
            answer["overlaps"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
        if overlaps.len() != FRAMES || overlaps.iter().any(|overlap| *overlap < MIN_OVERLAP) {
            wrong.push(answer.to_string());
        }
    }
    assert!(wrong.is_empty(), "of {}: {}", answers.len(), wrong.join("\n"));
}

#[test]
fn moving_pictures_play_as_long_in_a_browser() {
    let Some(script) = browser_script("moving.mjs") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let walk = samples::walk_clip();
    let fps = 23.976;
    let frames = (samples::walk_scene().clips[0].duration_seconds() * fps).round();
    let named = NamedBytes { name: "walk.glb", bytes: &walk };
    let paths = ["gif", "webp", "apng"].map(|ending| {
        let view = View { size: [64, 64], fps: Some(fps), ..View::default() };
        let options = PreviewOptions { view, ending: ending.to_owned(), clip: None };
        let picture = preview(named, &options, &Limits::default(), &Control::new()).expect("a picture");
        let path = folder.path().join(format!("walk.{ending}"));
        std::fs::write(&path, picture.bytes).expect("written");
        path
    });
    let output = Command::new("node").arg(script).args(&paths).output().expect("node runs");
    let answers = super::answers(&output, paths.len()).expect("an answer for each");
    for (answer, unit) in answers.iter().zip([0.01, 0.001, 0.001]) {
        assert_eq!(answer["frames"].as_f64(), Some(frames), "{answer}");
        assert_eq!(answer["loops"], Value::Null, "for ever: {answer}");
        let seconds = answer["seconds"].as_f64().expect("seconds");
        assert!((seconds - frames / fps).abs() <= unit / 2.0 + 1e-9, "{answer}");
    }
}

#[test]
fn moving_drawings_play_as_long_in_a_browser() {
    let Some(script) = browser_script("moving.mjs") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("written");
    write("child.zip", &samples::drawing());
    write("walk.glb", &samples::walk_clip());
    write("wanted.json", br#"{"task": "draw", "view": {"size": [97, 64]}, "edit": {"fps": 24}}"#);
    let mut names = vec!["child.gif", "child.webp", "child.apng"];
    if cfg!(feature = "mp4") {
        names.push("child.mp4");
    }
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(["draw", "--drawing", "child.zip", "--source", "walk.glb", "--config", "wanted.json"]);
    for name in names.iter().chain(&["poses.json"]) {
        command.args(["--output", name]);
    }
    let output = command.current_dir(folder.path()).output().expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let poses = std::fs::read(folder.path().join("poses.json")).expect("poses");
    let poses: Value = serde_json::from_slice(&poses).expect("JSON");
    let frames = poses["rig_joint_xy"].as_array().expect("frames").len() as f64;
    assert!(frames > 20.0, "it moves: {frames}");
    let paths: Vec<_> = names.iter().map(|name| folder.path().join(name)).collect();
    let output = Command::new("node").arg(script).args(&paths).output().expect("node runs");
    let answers = super::answers(&output, paths.len()).expect("an answer for each");
    for ((answer, name), unit) in answers.iter().zip(&names).zip([0.01, 0.001, 0.001, 0.002]) {
        let seconds = answer["seconds"].as_f64().unwrap_or_else(|| panic!("{name}: {answer}"));
        assert!((seconds - frames / 24.0).abs() <= unit / 2.0 + 1e-9, "{name}: {seconds} s of {frames} frames");
        if !name.ends_with("mp4") {
            assert_eq!(answer["frames"].as_f64(), Some(frames), "{name}: {answer}");
            assert_eq!(answer["loops"], Value::Null, "for ever: {name}: {answer}");
        }
    }
}

#[cfg(feature = "mp4")]
#[test]
fn videos_play_as_long_in_a_browser() {
    let Some(script) = browser_script("moving.mjs") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let walk = samples::walk_clip();
    let view = View { size: [98, 64], fps: Some(24.0), ..View::default() };
    let options = PreviewOptions { view, ending: "mp4".to_owned(), clip: None };
    let named = NamedBytes { name: "walk.glb", bytes: &walk };
    let picture = preview(named, &options, &Limits::default(), &Control::new()).expect("a picture");
    let path = folder.path().join("walk.mp4");
    std::fs::write(&path, picture.bytes).expect("written");
    let output = Command::new("node").arg(script).arg(&path).output().expect("node runs");
    let answers = super::answers(&output, 1).expect("an answer");
    let frames = (samples::walk_scene().clips[0].duration_seconds() * 24.0).round();
    let seconds = answers[0]["seconds"].as_f64().unwrap_or_else(|| panic!("{}", answers[0]));
    assert!((seconds - frames / 24.0).abs() < 0.002, "{}", answers[0]);
    assert_eq!(answers[0]["size"], json!([98, 64]), "{}", answers[0]);
}
