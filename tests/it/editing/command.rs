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
        self.run_plain(&[arguments, &["--config", "config.json"]].concat())
    }

    fn run_plain(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(arguments)
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

/// The names of the clips of a file, and how many frames they have.
fn clips(folder: &Folder, file: &str) -> Vec<(String, u64)> {
    let output = folder.run_plain(&["inspect", file, "--json"]);
    let inspected: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let clips = inspected["clips"].as_array().expect("clips").iter();
    clips
        .map(|clip| (clip["name"].as_str().unwrap_or_default().to_owned(), clip["frames"].as_u64().unwrap_or(0)))
        .collect()
}

#[test]
fn an_edit_takes_the_place_of_its_clip_unless_it_has_another_name() {
    let folder = Folder::new();
    let edit = |from: &str, to: &str, config: Value| {
        let output = folder.run(&["edit", "--input", from, "--output", to, "--force"], &config);
        assert!(output.status.success(), "{}", error(&output));
        error(&output)
    };
    let walk = clips(&folder, "walk.glb")[0].clone();
    for ending in ["glb", "gltf", "fbx"] {
        let (short, both, again) = (format!("short.{ending}"), format!("both.{ending}"), format!("again.{ending}"));
        let trimmed = json!({"edit": {"range": {"frames": [0, 9]}}});
        edit("walk.glb", &short, trimmed.clone());
        assert_eq!(clips(&folder, &short), [(walk.0.clone(), 10)], "{ending}");
        edit("walk.glb", &both, json!({"edit": {"range": {"frames": [0, 4]}}, "output": {"clip_name": "stroll"}}));
        assert_eq!(clips(&folder, &both), [("stroll".to_owned(), 5), walk.clone()], "{ending}");
        let told = edit(&both, &again, json!({"edit": {"range": {"frames": [0, 9]}}, "clip": walk.0}));
        assert_eq!(clips(&folder, &again), [(walk.0.clone(), 10), ("stroll".to_owned(), 5)], "{ending}: {told}");
    }
    edit("walk.glb", "same.glb", json!({"output": {"clip_name": ""}}));
    let told = edit("same.glb", "told.glb", json!({}));
    assert!(
        told.contains(&format!("give one in \"clip\": 0, {}", walk.0)),
        "who has no name is told by number: {told}"
    );
}
