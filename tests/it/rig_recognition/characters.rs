//! Several characters in one file: which is taken, that it is said, and that the config chooses.

use std::process::Command;

use glam::DVec3;
use retargetd::{
    formats::{self, Format, WriteOptions},
    model::{Clip, Control, Joint, JointTracks, Reporter, Scene, Skeleton, Warning},
    rig::{Rig, RigSpec},
    samples,
};
use serde_json::json;

/// The mannequin, and `count` more of them two meters apart, each below a node of its own; names as exporters repeat them.
fn crowd(count: usize) -> Scene {
    let mannequin = samples::mannequin_scene();
    let alone = mannequin.skeleton.joints();
    let mut joints: Vec<Joint> = Vec::new();
    for place in 0..=count {
        let base = joints.len();
        joints.extend(alone.iter().cloned().map(|mut joint| {
            if joint.parent.is_none() {
                joint.rest.translation += DVec3::X * 2.0 * place as f64;
            }
            if place > 0 {
                joint.name = format!("{}.{place:03}", joint.name);
            }
            joint.parent = joint.parent.map(|parent| parent + base);
            joint.node += base;
            joint
        }));
    }
    Scene {
        skeleton: Skeleton::new(joints).expect("parents come first"),
        clips: Vec::new(),
        skins: Vec::new(),
        ..mannequin
    }
}

fn seen<'a>(scene: &'a Scene, character: Option<&str>) -> (Rig<'a>, Vec<Warning>) {
    let spec = RigSpec { character: character.map(str::to_owned), ..RigSpec::default() };
    let mut reporter = Reporter::new();
    let rig = Rig::new("target", scene, None, &spec, &mut reporter).expect("a rig");
    let warnings = reporter.into_warnings().into_iter().filter(|warning| warning.code == "several_characters");
    (rig, warnings.collect())
}

#[test]
fn of_several_characters_one_is_taken_and_the_others_are_told() {
    for count in [1, 3] {
        let scene = crowd(count);
        let (rig, warnings) = seen(&scene, None);
        let pelvis = rig.role("pelvis")[0];
        let name = &scene.skeleton.joints()[pelvis].name;
        let [warning] = warnings.as_slice() else { panic!("one warning: {warnings:?}") };
        assert!(warning.detail.contains(&format!("{} characters", count + 1)), "{warning}");
        assert!(warning.detail.contains(&format!("'{name}' is taken")), "{warning}");
        assert!(warning.hint.contains("target.character"), "{warning}");
    }
}

#[test]
fn the_config_chooses_a_character_by_any_joint_above_it() {
    let scene = crowd(2);
    let alone = samples::mannequin_scene();
    let (plain, _) = seen(&alone, None);
    let count = alone.skeleton.len();
    let top = &alone.skeleton.joints()[0].name;
    for (place, name) in [(0, top.clone()), (1, format!("{top}.001")), (2, format!("{top}.002"))] {
        let (rig, warnings) = seen(&scene, Some(&name));
        assert!(warnings.is_empty(), "{name} was asked for: {warnings:?}");
        assert_eq!(rig.recognition.kind, plain.recognition.kind, "{name}");
        for (role, finding) in &plain.recognition.roles {
            let expected: Vec<usize> = finding.joints.iter().map(|joint| joint + place * count).collect();
            assert_eq!(rig.recognition.roles[role].joints, expected, "{name}: {role}");
        }
    }
}

#[test]
fn one_character_is_not_several() {
    let (_, warnings) = seen(&crowd(0), None);
    assert!(warnings.is_empty(), "{warnings:?}");
}

#[test]
fn a_character_that_is_not_there_is_refused() {
    let scene = crowd(1);
    let spec = RigSpec { character: Some("nobody".to_owned()), ..RigSpec::default() };
    let error = Rig::new("target", &scene, None, &spec, &mut Reporter::new()).expect_err("no such joint");
    assert!(error.to_string().contains("nobody"), "{error}");
}

/// Runs `retargetd retarget` in a folder that has the walk and a crowd of two in it.
fn retargeted(folder: &std::path::Path, source: &str, config: &serde_json::Value) -> (bool, String) {
    let crowd = crowd(1);
    let still =
        Clip::new(String::new(), vec![0.0], vec![JointTracks::default(); crowd.skeleton.len()]).expect("a clip");
    let options = WriteOptions::new(Format::PosesJson);
    let bytes = formats::write(&crowd, &still, &options, &Control::new(), &mut Reporter::new()).expect("pose arrays");
    std::fs::write(folder.join("crowd.json"), bytes).expect("the crowd");
    std::fs::write(folder.join("walk.glb"), samples::walk_clip()).expect("the walk");
    std::fs::write(folder.join("config.json"), config.to_string()).expect("the config");
    let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["retarget", "--source", source, "--target", "crowd.json", "--config", "config.json"])
        .args(["--output", "out.json", "--report", "report.json", "--force"])
        .current_dir(folder)
        .output()
        .expect("the binary runs");
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn read(path: &std::path::Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).expect("the file")).expect("JSON")
}

#[test]
fn all_characters_of_a_target_are_moved() {
    let folder = tempfile::tempdir().expect("a folder");
    let (done, error) = retargeted(folder.path(), "walk.glb", &json!({"target": {"character": "all"}}));
    assert!(done, "{error}");
    let report = read(&folder.path().join("report.json"));
    let views = report["characters"].as_array().expect("characters");
    assert_eq!(views.len(), 2, "{views:?}");
    assert!(views.iter().all(|view| view["verdict"].is_string()), "{views:?}");
    let driven: u64 = views.iter().filter_map(|view| view["driven_joints"].as_u64()).sum();
    assert_eq!(report["counts"]["driven_joints"], driven, "those of both");
    assert_eq!(report["resolved_spec"]["target"]["character"], "all", "again the same");
    let poses = read(&folder.path().join("out.json"));
    let frames = poses["rotations"].as_array().expect("frames");
    let half = frames[0].as_array().expect("joints").len() / 2;
    let mut moves = false;
    for frame in frames {
        let joints = frame.as_array().expect("joints");
        for (one, other) in joints[..half].iter().zip(&joints[half..]) {
            for axis in 0..4 {
                let [one, other] = [one, other].map(|turn| turn[axis].as_f64().expect("a number"));
                assert!((one - other).abs() < 1e-5, "both turn alike: {one} and {other}");
            }
        }
        moves |= joints[half..] != frames[0].as_array().expect("joints")[half..];
    }
    assert!(moves, "the second one moves");
    let place = |frame: usize| {
        let parents = poses["parents"].as_array().expect("parents");
        let at = |joint: usize| poses["translations"][frame][joint][0].as_f64().expect("a number");
        let pelvis = poses["joint_names"].as_array().and_then(|names| names.iter().position(|name| name == "pelvis"));
        let pelvis = pelvis.expect("a pelvis");
        [0, half].map(|base| {
            let up = |joint: &usize| parents[*joint].as_i64().and_then(|parent| usize::try_from(parent).ok());
            std::iter::successors(Some(pelvis + base), up).map(at).sum::<f64>()
        })
    };
    let [one, other] = place(30);
    assert!((other - one - 2.0).abs() < 0.01, "they stay two meters apart: {one}, {other}");

    std::fs::rename(folder.path().join("out.json"), folder.path().join("two.json")).expect("a source of two");
    let both = json!({"source": {"character": "all"}, "target": {"character": "all"}});
    let (done, error) = retargeted(folder.path(), "two.json", &both);
    assert!(done, "{error}");
    let views = read(&folder.path().join("report.json"))["characters"].clone();
    assert!(views[0]["source"] != views[1]["source"] && views[1]["source"].is_string(), "one by one: {views}");
}

#[test]
fn all_characters_cannot_be_asked_for_where_one_is_meant() {
    let folder = tempfile::tempdir().expect("a folder");
    for (config, place) in [
        (json!({"target": {"character": "all", "root": "Hips"}}), "/target/root"),
        (json!({"target": {"character": "all"}, "tune": true}), "/tune"),
        (json!({"source": {"character": "all"}}), "/source/character"),
        (json!({"source": {"character": "all"}, "target": {"character": "all"}}), "1 characters and the target 2"),
    ] {
        let (done, error) = retargeted(folder.path(), "walk.glb", &config);
        assert!(!done && error.contains(place), "{config}: {error}");
    }
    let spec = RigSpec { character: Some("all".to_owned()), ..RigSpec::default() };
    let error = Rig::new("source", &crowd(1), None, &spec, &mut Reporter::new()).expect_err("one is meant");
    assert!(error.to_string().contains("retargeted onto a target"), "{error}");
}
