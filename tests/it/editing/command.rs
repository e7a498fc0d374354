//! `retargetd edit`, and `edit` in the config of a retarget, by running the real binary.

use std::process::{Command, Output, Stdio};

use retargetd::{retarget::EditSpec, samples};
use serde_json::{Value, json};

use crate::support::validate_gltf;

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("walk.glb"), samples::walk_clip()).expect("the walk");
        std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
        Self(folder)
    }

    fn run(&self, arguments: &[&str], config: &Value) -> Output {
        std::fs::write(self.0.path().join("config.json"), config.to_string()).expect("the config");
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(arguments)
            .args(["--config", "config.json"])
            .current_dir(self.0.path())
            .stdin(Stdio::null())
            .output()
            .expect("the binary runs")
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&std::fs::read(self.0.path().join(name)).expect("the file")).expect("JSON")
    }
}

fn error(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_file_is_edited_onto_itself() {
    let folder = Folder::new();
    let config = json!({"edit": {"range": [0.0, 2.0], "fps": 60, "reverse": true, "mirror": true}});
    let output = folder.run(
        &["edit", "--input", "walk.glb", "--output", "out.glb", "--output", "out.json", "--report", "report.json"],
        &config,
    );
    assert_eq!(output.status.code(), Some(0), "{}", error(&output));
    let poses = folder.json("out.json");
    assert_eq!(poses["times"].as_array().map(Vec::len), Some(121), "two seconds at 60 frames");
    let report = folder.json("report.json");
    assert_eq!(report["counts"]["frames"], 121, "the report counts them too");
    assert_eq!(report["warnings"], json!([]), "a symmetric figure needs no warning");
    let done: EditSpec = serde_json::from_value(report["resolved_spec"]["edit"].clone()).expect("an edit");
    let asked: EditSpec = serde_json::from_value(config["edit"].clone()).expect("an edit");
    assert_eq!(done, asked, "what was done is on record");
    let glb = folder.0.path().join("out.glb");
    if let Some(reports) = validate_gltf(&[&glb]) {
        assert_eq!(reports[glb.as_path()]["codes"], json!({}), "the Khronos validator finds no error");
    }
}

#[test]
fn a_retarget_edits_on_its_way() {
    let folder = Folder::new();
    let arguments = ["retarget", "--source", "walk.glb", "--target", "mannequin.glb", "--output", "out.json"];
    let output = folder.run(&arguments, &json!({"edit": {"range": [1.0, 2.0], "speed": 0.5, "fps": 24}}));
    assert_eq!(output.status.code(), Some(0), "{}", error(&output));
    let poses = folder.json("out.json");
    let times: Vec<f64> = poses["times"].as_array().expect("times").iter().filter_map(Value::as_f64).collect();
    assert_eq!(times.len(), 49, "two seconds at 24 frames");
    assert!((times[48] - 2.0).abs() < 1e-6, "the last at the end");
}

/// The file has its 36th frame at 1.2 s as an `f32`, a moment later: two frames for one failed over an elbow that moved in no time.
#[test]
fn a_clip_that_is_trimmed_at_a_frame_has_no_frame_beside_it() {
    let folder = Folder::new();
    for (range, frames) in [([1.2, 4.0], 85), ([0.0, 3.3], 100), ([0.7, 1.7], 31)] {
        let arguments = ["retarget", "--source", "walk.glb", "--target", "mannequin.glb", "--output", "out.glb"];
        let output =
            folder.run(&[&arguments[..], &["--report", "report.json"]].concat(), &json!({"edit": {"range": range}}));
        assert_eq!(output.status.code(), Some(0), "{}", error(&output));
        let report = folder.json("report.json");
        assert_eq!(report["counts"]["frames"], frames, "{range:?}");
        assert_eq!(report["measures"]["verdict"], "pass", "{range:?}: {}", report["measures"]["verdict_reason"]);
    }
}

#[test]
fn what_cannot_be_done_is_refused_with_its_place() {
    let folder = Folder::new();
    let cases = [
        (json!({"edit": {"range": [9.0, 10.0]}}), "/edit/range"),
        (json!({"edit": {"sped": 2.0}}), "/edit/sped"),
        (
            json!({"edit": {"mirror": {"pairs": [["mixamorig:LeftFoot", "mixamorig:RightFot"]]}}}),
            "/edit/mirror/pairs/0/1",
        ),
    ];
    for (config, pointer) in cases {
        let output = folder.run(&["edit", "--input", "walk.glb", "--output", "out.glb"], &config);
        assert_eq!(output.status.code(), Some(3), "{config}: {}", error(&output));
        assert!(error(&output).contains(pointer), "{config}: {}", error(&output));
        assert!(!folder.0.path().join("out.glb").exists(), "{config}: nothing is written");
    }
}

#[test]
fn fields_that_only_a_retarget_heeds_are_named() {
    let folder = Folder::new();
    let config = json!({"ops": [{"op": "pelvis"}], "edit": {"reverse": true}});
    let output = folder.run(&["edit", "--input", "walk.glb", "--output", "out.bvh"], &config);
    assert_eq!(output.status.code(), Some(0), "{}", error(&output));
    assert!(error(&output).contains("field_without_effect: /ops"), "{}", error(&output));
}
