//! Rest files on the command line: what the program writes is taken as it stands, and what does not fit is refused.

use super::{code, error, folder, retargetd};

#[test]
fn what_pose_writes_is_a_rest_file_in_every_format() {
    let folder = folder();
    for ending in ["glb", "bvh", "fbx", "npz", "json"] {
        let file = format!("t.{ending}");
        let posed = retargetd(&["pose", "--input", "mannequin.glb", "--to", "t", "--output", &file], folder.path());
        assert_eq!(code(&posed), Some(0), "{}", error(&posed));
        let arguments = [
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--target-rest",
            &file,
            "--output",
            "out.glb",
            "--report",
            "report.json",
        ];
        let output = retargetd(&arguments, folder.path());
        assert_eq!(code(&output), Some(0), "{}", error(&output));
        let report = std::fs::read_to_string(folder.path().join("report.json")).expect("a report");
        let report: serde_json::Value = serde_json::from_str(&report).expect("JSON");
        let target = &report["rigs"]["target"];
        assert_eq!(target["rest_pose"], "T", "{file}: {target}");
        assert_eq!(target["rest_pose_from"], "upload", "{file}: {target}");
        let residual = target["rest_file"]["residual_degrees"].as_f64().expect("degrees");
        assert!(residual < 0.5, "{file}: {target}");
        assert_eq!(report["measures"]["metrics"]["rest_residual"]["verdict"], "pass", "{file}");
    }
}

#[test]
fn a_rest_file_of_nobody_is_refused() {
    let folder = folder();
    let bvh = "HIERARCHY\nROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 3 Zrotation Xrotation Yrotation\nEnd Site\n{\nOFFSET 0 1 0\n}\n}\n\
               MOTION\nFrames: 1\nFrame Time: 0.03\n0 0 0\n";
    std::fs::write(folder.path().join("one.bvh"), bvh).expect("a file");
    let arguments = [
        "retarget",
        "--source",
        "walk.glb",
        "--target",
        "mannequin.glb",
        "--target-rest",
        "one.bvh",
        "--output",
        "out.glb",
    ];
    let output = retargetd(&arguments, folder.path());
    assert_eq!(code(&output), Some(3), "{}", error(&output));
    assert!(error(&output).contains("rest file of the target"), "{}", error(&output));
}
