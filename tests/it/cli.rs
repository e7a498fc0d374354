//! The command line, by running the real binary.

pub(crate) mod carried_curves;
mod checks;
mod habits;
mod long_clips;
mod real_ops;
mod reports;
mod rest_files;

use std::{
    path::Path,
    process::{Command, Output, Stdio},
};

use retargetd::samples;
use tempfile::TempDir;

fn retargetd(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .expect("the binary runs")
}

fn code(output: &Output) -> Option<i32> {
    output.status.code()
}

fn error(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder with the two samples.
fn folder() -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("walk.glb"), samples::walk_clip()).expect("the walk");
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    folder
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

mod usage {
    use super::*;

    #[test]
    fn missing_arguments_are_bad_usage() {
        let folder = tempfile::tempdir().expect("a folder");
        for arguments in
            [&[][..], &["retarget"], &["retarget", "--source", "a.fbx"], &["inspect"], &["no-such-command"]]
        {
            let output = retargetd(arguments, folder.path());
            assert_eq!(code(&output), Some(2), "{arguments:?}: {}", error(&output));
            assert!(output.stdout.is_empty(), "{arguments:?}: nothing on standard output");
        }
    }

    #[test]
    fn an_ending_that_stands_for_nothing_lists_those_that_do() {
        let folder = tempfile::tempdir().expect("a folder");
        for ending in ["out.xyz", "out", "out.npy"] {
            let output =
                retargetd(&["retarget", "--source", "a.glb", "--target", "b.glb", "--output", ending], folder.path());
            assert_eq!(code(&output), Some(2), "{ending}");
            let text = error(&output);
            assert!(text.starts_with("error: output ") && text.contains("hint: ") && text.contains(".glb"), "{text}");
        }
    }

    #[test]
    fn places_are_checked_before_the_work() {
        let folder = folder();
        for output in ["nowhere/out.glb", "."] {
            let result = retargetd(
                &[
                    "retarget",
                    "--source",
                    "walk.glb",
                    "--target",
                    "mannequin.glb",
                    "--output",
                    "out.glb",
                    "--report",
                    output,
                ],
                folder.path(),
            );
            assert_eq!(code(&result), Some(2), "{output}: {}", error(&result));
        }
        let twice = retargetd(
            &[
                "retarget",
                "--source",
                "walk.glb",
                "--target",
                "mannequin.glb",
                "--output",
                "a.glb",
                "--output",
                "a.glb",
            ],
            folder.path(),
        );
        assert_eq!(code(&twice), Some(2), "{}", error(&twice));
        assert_eq!(names(folder.path()), ["mannequin.glb", "walk.glb"], "nothing was written");
    }
}

mod inputs {
    use super::*;

    fn refused(source: &str, folder: &Path) -> String {
        let output =
            retargetd(&["retarget", "--source", source, "--target", "mannequin.glb", "--output", "out.glb"], folder);
        assert_eq!(code(&output), Some(3), "{source}: {}", error(&output));
        assert!(!folder.join("out.glb").exists(), "{source}: no output");
        let text = error(&output);
        assert!(text.starts_with(&format!("error: source {source}: ")), "one clear line: {text}");
        text
    }

    #[test]
    fn a_missing_file_is_named() {
        let folder = folder();
        assert!(refused("nowhere.glb", folder.path()).contains("there is no such file"), "says what is wrong");
        std::fs::create_dir(folder.path().join("folder.glb")).expect("a folder");
        assert!(refused("folder.glb", folder.path()).contains("folder"), "says what is wrong");
    }

    #[test]
    fn what_is_no_model_is_refused() {
        let folder = folder();
        std::fs::write(folder.path().join("notes.txt"), "nothing of the kind").expect("written");
        assert!(refused("notes.txt", folder.path()).contains("hint: "), "says what to send");
        std::fs::write(folder.path().join("empty.glb"), "").expect("written");
        assert!(refused("empty.glb", folder.path()).contains("empty"), "says what is wrong");
        std::fs::write(folder.path().join("poses.json"), r#"{"joint_names": ["a"], "parents": [0]}"#).expect("written");
        refused("poses.json", folder.path());
    }

    #[test]
    fn a_file_over_the_limit_is_not_read() {
        let folder = folder();
        let file = std::fs::File::create(folder.path().join("large.glb")).expect("created");
        file.set_len(300 << 20).expect("a sparse file");
        assert!(refused("large.glb", folder.path()).contains("bytes"), "says how large it is");
    }

    #[test]
    fn inspect_refuses_in_the_same_way() {
        let folder = folder();
        let output = retargetd(&["inspect", "nowhere.glb"], folder.path());
        assert_eq!(code(&output), Some(3), "{}", error(&output));
        assert!(error(&output).starts_with("error: file nowhere.glb: "), "{}", error(&output));
    }
}

/// Needs the engine with its formats and rigs.
mod engine {
    use super::*;

    #[test]
    fn a_truncated_file_is_refused() {
        let folder = folder();
        let walk = samples::walk_clip();
        std::fs::write(folder.path().join("cut.glb"), &walk[..walk.len() / 2]).expect("written");
        let output = retargetd(&["inspect", "cut.glb"], folder.path());
        assert_eq!(code(&output), Some(3), "{}", error(&output));
        assert_eq!(error(&output).lines().filter(|line| line.starts_with("error: ")).count(), 1, "one line");
    }

    #[test]
    fn a_pose_becomes_a_file() {
        let folder = folder();
        let kind = |file: &str| {
            let output = retargetd(&["inspect", file, "--json"], folder.path());
            assert_eq!(code(&output), Some(0), "{file}: {}", error(&output));
            let inspection: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
            inspection["rigs"][0]["rest_pose"].as_str().expect("a kind").to_owned()
        };
        for (to, file, wanted) in
            [("t", "t.npz", "T"), ("a", "a.npz", "A"), ("walk.glb", "walker.bvh", "T"), ("rest", "rest.json", "A")]
        {
            let output = retargetd(&["pose", "--input", "mannequin.glb", "--to", to, "--output", file], folder.path());
            assert_eq!(code(&output), Some(0), "{to}: {}", error(&output));
            assert!(error(&output).contains("joints turned"), "it says what it did: {}", error(&output));
            assert_eq!(kind(file), wanted, "{to}");
        }
        let refused = |arguments: &[&str], wanted: i32| {
            let all = [&["pose", "--input", "mannequin.glb"], arguments].concat();
            let output = retargetd(&all, folder.path());
            assert_eq!(code(&output), Some(wanted), "{arguments:?}: {}", error(&output));
            assert!(error(&output).contains("hint: "), "{arguments:?}: {}", error(&output));
        };
        refused(&["--to", "no-such-file.glb", "--output", "x.glb"], 2);
        refused(&["--output", "x.xyz"], 2);
        std::fs::write(folder.path().join("bad.json"), r#"{"target": {"pse": []}}"#).expect("written");
        refused(&["--config", "bad.json", "--output", "x.glb"], 3);
        assert!(!names(folder.path()).contains(&"x.glb".to_owned()), "nothing half done is left");
    }

    #[test]
    fn inspect_prints_one_object() {
        let folder = folder();
        let output = retargetd(&["inspect", "mannequin.glb", "--json"], folder.path());
        assert_eq!(code(&output), Some(0), "{}", error(&output));
        let inspection: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one JSON object");
        assert_eq!(inspection["format"], "glb", "the format");
        assert_eq!(inspection["counts"]["joints"], 80, "joints of the skin");
        assert_eq!(inspection["counts"]["clips"], 0, "no clip");
        assert_eq!(inspection["rigs"][0]["kind"], "biped", "a biped");
        assert_eq!(inspection["rigs"][0]["rest_pose"], "A", "in an A pose");
        assert_eq!(inspection["rigs"][0]["roles"]["pelvis"], "pelvis", "with a pelvis");
        let text = retargetd(&["inspect", "walk.glb"], folder.path());
        assert_eq!(code(&text), Some(0), "{}", error(&text));
        assert!(!text.stdout.is_empty(), "text for people");
    }

    #[test]
    fn a_closed_pipe_is_no_panic() {
        let folder = folder();
        let mut child = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["inspect", "mannequin.glb", "--json"])
            .current_dir(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs");
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(code(&output), Some(0), "{}", error(&output));
        assert!(!error(&output).contains("panicked"), "{}", error(&output));
    }

    #[test]
    fn the_main_job_gives_every_output() {
        let folder = folder();
        let arguments = [
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--output",
            "out.glb",
            "--output",
            "out.npz",
            "--output",
            "out.json",
            "--report",
            "report.json",
        ];
        let output = retargetd(&arguments, folder.path());
        assert_eq!(code(&output), Some(0), "{}", error(&output));
        assert!(output.stdout.is_empty(), "nothing on standard output");
        assert!(
            error(&output).lines().last().is_some_and(|line| line.starts_with("wrote out.glb, out.npz")),
            "{}",
            error(&output)
        );
        assert_eq!(
            names(folder.path()),
            ["mannequin.glb", "out.glb", "out.json", "out.npz", "report.json", "walk.glb"],
            "no temporary file is left"
        );
        let report = std::fs::read(folder.path().join("report.json")).expect("a report");
        let report: serde_json::Value = serde_json::from_slice(&report).expect("JSON");
        assert_eq!(report["counts"]["frames"], 121, "as long as the source");
        for timing in ["read_seconds", "plan_seconds", "retarget_seconds", "write_seconds", "total_seconds"] {
            assert!(report["timings"][timing].is_number(), "{timing}");
        }
        assert!(report["timings"]["total_seconds"].as_f64() > Some(0.0), "the clock runs");
        assert!(report["resolved_spec"].is_object(), "the spec that makes it again");
        assert!(report["warnings"].is_array(), "warnings");
    }

    #[test]
    fn a_config_that_does_not_fit_names_the_place() {
        let folder = folder();
        std::fs::write(folder.path().join("spec.json"), r#"{"sorce": {}}"#).expect("written");
        let arguments = [
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--config",
            "spec.json",
            "--output",
            "out.glb",
        ];
        let output = retargetd(&arguments, folder.path());
        assert_eq!(code(&output), Some(3), "{}", error(&output));
        let text = error(&output);
        assert!(text.starts_with("error: config spec.json: "), "{text}");
        assert!(text.contains("/sorce") && text.contains("did you mean source"), "{text}");
    }
}
