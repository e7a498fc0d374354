//! Reports as pages, explanations and tuning on the command line.

use serde_json::Value;

use super::{code, error, folder, retargetd};
use crate::support::corpus_file;

const FILES: [&str; 4] = ["--source", "walk.glb", "--target", "mannequin.glb"];

fn run(folder: &std::path::Path, command: &str, more: &[&str]) -> std::process::Output {
    let arguments: Vec<&str> = [command].into_iter().chain(FILES).chain(more.iter().copied()).collect();
    retargetd(&arguments, folder)
}

#[test]
fn the_ending_of_the_report_picks_a_page() {
    let folder = folder();
    let output = run(folder.path(), "retarget", &["--output", "out.glb", "--report", "report.html"]);
    assert_eq!(code(&output), Some(0), "{}", error(&output));
    let page = std::fs::read_to_string(folder.path().join("report.html")).expect("the page");
    assert!(page.starts_with("<!doctype html>") && page.contains("<svg"), "a page with plots");
}

#[test]
fn a_joint_is_explained_as_text_and_as_json() {
    let folder = folder();
    let asked = ["--frame", "30", "--joint", "pelvis"];
    let text = run(folder.path(), "explain", &asked);
    assert_eq!(code(&text), Some(0), "{}", error(&text));
    let text = String::from_utf8(text.stdout).expect("text");
    for word in ["follows 100 %", "alignment", "delta", "result", "position"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    let json = run(folder.path(), "explain", &[&asked[..], &["--json"]].concat());
    let json: Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert_eq!(json["driver"], "pelvis", "{json}");
    let missing = run(folder.path(), "explain", &["--frame", "30", "--joint", "pelvi"]);
    assert_eq!(code(&missing), Some(3), "there is no such joint");
    assert!(error(&missing).contains("pelvi"), "{}", error(&missing));
}

#[test]
fn tuning_says_what_it_found() {
    let folder = folder();
    let config =
        r#"{"tune": {"max_evaluations": 10}, "ops": [{"op": "pelvis", "scale_horizontal": 1.2}, {"op": "fk"}]}"#;
    std::fs::write(folder.path().join("tune.json"), config).expect("written");
    let more = ["--config", "tune.json", "--output", "out.npz", "--report", "report.json"];
    let output = run(folder.path(), "retarget", &more);
    assert_eq!(code(&output), Some(0), "{}", error(&output));
    let report = std::fs::read_to_string(folder.path().join("report.json")).expect("the report");
    let report: Value = serde_json::from_str(&report).expect("JSON");
    let (before, after) = (&report["tuning"]["score_before"], &report["tuning"]["score_after"]);
    assert!(after.as_f64() < before.as_f64(), "better: {}", report["tuning"]);
    assert_eq!(report["resolved_spec"]["tune"], Value::Null, "what was found is not searched again");
}

#[test]
fn strict_fails_on_a_failed_measure() {
    let folder = folder();
    let threshold =
        r#"{"foot_slide": {"warn_above": 0, "fail_above": 0}, "floor_float": {"warn_above": 0, "fail_above": 0}}"#;
    let config = format!(
        r#"{{"strict": true, "report": {{"thresholds": {threshold}}}, "ops": [{{"op": "pelvis", "scale_horizontal": 1.3}}, {{"op": "fk"}}]}}"#
    );
    std::fs::write(folder.path().join("strict.json"), config).expect("written");
    let output = run(folder.path(), "retarget", &["--config", "strict.json", "--output", "out.npz"]);
    assert_eq!(code(&output), Some(3), "a measure fails: {}", error(&output));
    assert!(error(&output).contains("foot_slide"), "it is named: {}", error(&output));
    assert!(!folder.path().join("out.npz").exists(), "nothing was written");
}

#[test]
fn who_walks_on_the_spot_is_told_how_fast_to_move() {
    let folder = folder();
    let standing = run(folder.path(), "retarget", &["--output", "out.npz"]);
    assert!(!error(&standing).contains("on the spot"), "{}", error(&standing));
    let Some(walk) = corpus_file("mixamo/fbx/walking_noskin.fbx") else { return };
    let walk = walk.to_str().expect("a path");
    let arguments = ["retarget", "--source", walk, "--target", "mannequin.glb", "--output", "spot.npz"];
    let running = retargetd(&[&arguments[..], &["--report", "report.json"]].concat(), folder.path());
    assert_eq!(code(&running), Some(0), "{}", error(&running));
    assert!(error(&running).contains("floor: the figure walks on the spot"), "{}", error(&running));
    let report = std::fs::read_to_string(folder.path().join("report.json")).expect("the report");
    let report: Value = serde_json::from_str(&report).expect("JSON");
    let speed = report["measures"]["floor_speed_meters_per_second"]["target"].as_f64().expect("a speed");
    assert!((0.5..3.0).contains(&speed), "{speed} m/s");
    assert!(report["measures"]["metrics"]["foot_slide"]["value"].is_number(), "and feet are measured");
}
