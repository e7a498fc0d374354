//! The demo command.

use std::{path::Path, process::Command};

#[test]
fn the_demo_leaves_a_glb_pose_arrays_and_a_report() {
    let folder = tempfile::tempdir().expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["demo", "--output"])
        .arg(folder.path().join("results"))
        .env("TMPDIR", folder.path())
        .output()
        .expect("the binary runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let endings = |folder: &Path| {
        let mut endings: Vec<String> = std::fs::read_dir(folder)
            .expect("a folder")
            .filter_map(|entry| entry.expect("an entry").path().extension()?.to_str().map(str::to_owned))
            .collect();
        endings.sort();
        endings
    };
    assert_eq!(endings(&folder.path().join("results")), ["glb", "json", "npz", "png"], "the files that it promises");
    let report = std::fs::read(folder.path().join("results/report.json")).expect("the report");
    let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
    assert_eq!(report["counts"]["frames"], 121, "as long as the walk");
    let left: Vec<_> = std::fs::read_dir(folder.path()).expect("a folder").collect();
    assert_eq!(left.len(), 1, "the data folder of the service is gone: {left:?}");
}
