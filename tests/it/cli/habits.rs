//! What people expect of any command: pipes, many files, silence, words for programs, completions.

use std::{
    io::Write as _,
    path::Path,
    process::{Command, Output, Stdio},
};

use serde_json::Value;

use super::{code, error, folder, retargetd};

const FILES: [&str; 5] = ["retarget", "--source", "walk.glb", "--target", "mannequin.glb"];

fn object(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|wrong| panic!("{wrong}: {}", error(output)))
}

/// With that on standard input.
fn piped(arguments: &[&str], input: &[u8], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(arguments).current_dir(folder).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the binary runs");
    child.stdin.take().expect("a pipe").write_all(input).expect("it reads");
    child.wait_with_output().expect("it ends")
}

#[test]
fn clips_come_from_standard_input_and_results_go_to_standard_output() {
    let folder = folder();
    let walk = std::fs::read(folder.path().join("walk.glb")).expect("the walk");
    let plain = retargetd(&[&FILES[..], &["--output", "out.glb"]].concat(), folder.path());
    assert_eq!(code(&plain), Some(0), "{}", error(&plain));
    let through = ["retarget", "--source", "-", "--target", "mannequin.glb", "--output", "-"];
    let output = piped(&through, &walk, folder.path());
    assert_eq!(code(&output), Some(0), "{}", error(&output));
    assert!(output.stdout == std::fs::read(folder.path().join("out.glb")).expect("the result"), "the same bytes");
    let bvh = piped(&[&through[..], &["--format", "bvh"]].concat(), &walk, folder.path());
    assert!(bvh.stdout.starts_with(b"HIERARCHY"), "in another format: {}", error(&bvh));
    let twice = piped(&["retarget", "--source", "-", "--target", "-", "--output", "o.glb"], &walk, folder.path());
    assert!(code(&twice) == Some(2) && error(&twice).contains("standard input is another input"), "{}", error(&twice));
    let unknown = retargetd(&[&FILES[..], &["--output", "-", "--format", "doc"]].concat(), folder.path());
    assert!(code(&unknown) == Some(2) && error(&unknown).contains("--format doc"), "{}", error(&unknown));
    let idle = retargetd(&[&FILES[..], &["--output", "o.glb", "--format", "bvh"]].concat(), folder.path());
    assert_eq!(code(&idle), Some(2), "it says nothing there: {}", error(&idle));
}

#[test]
fn several_files_are_inspected_and_one_that_cannot_be_read_is_told() {
    let folder = folder();
    std::fs::write(folder.path().join("notes.glb"), "tuesday is better").expect("a note");
    let both = retargetd(&["inspect", "walk.glb", "mannequin.glb"], folder.path());
    let text = String::from_utf8_lossy(&both.stdout).into_owned();
    assert_eq!(code(&both), Some(0), "{}", error(&both));
    assert!(text.contains("== walk.glb") && text.contains("== mannequin.glb"), "{text}");
    let some = retargetd(&["inspect", "notes.glb", "walk.glb", "--json"], folder.path());
    assert_eq!(code(&some), Some(3), "{}", error(&some));
    let files = object(&some)["files"].clone();
    assert_eq!(files[0]["error"]["exit_code"], 3, "{files}");
    assert_eq!(files[1]["inspection"]["format"], "glb", "{files}");
    assert!(error(&some).contains("1 of 2 files"), "{}", error(&some));
}

#[test]
fn a_folder_is_retargeted_with_a_table_of_verdicts() {
    let folder = folder();
    let place = |name: &str| folder.path().join(name);
    for name in ["clips", "out"] {
        std::fs::create_dir(place(name)).expect("a folder");
    }
    for name in ["monday.glb", "tuesday.glb"] {
        std::fs::copy(place("walk.glb"), place("clips").join(name)).expect("a clip");
    }
    let asked = ["retarget", "--batch", "clips", "--target", "mannequin.glb", "--output", "out/{name}.glb"];
    let output = retargetd(&[&asked[..], &["--report", "out/{name}.json"]].concat(), folder.path());
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(code(&output), Some(0), "{}", error(&output));
    let lines: Vec<&str> = table.lines().collect();
    assert!(lines[0].starts_with("clip") && lines[1].starts_with("monday") && lines.len() == 3, "{table}");
    assert!(place("out/monday.glb").exists() && place("out/tuesday.json").exists(), "every result");
    std::fs::write(place("clips/broken.bvh"), "HIERARCHY\nROOT Hips\n").expect("a clip that breaks off");
    let some = retargetd(&[&asked[..], &["--json", "--quiet"]].concat(), folder.path());
    assert_eq!(code(&some), Some(3), "{}", error(&some));
    let clips = object(&some)["clips"].clone();
    assert!(clips[0]["error"]["message"].is_string() && clips[1]["verdict"].is_string(), "{clips}");
    assert!(!error(&some).contains("wrote"), "quiet: {}", error(&some));
    let judged = retargetd(&[&asked[..], &["--fail-on", "warn"]].concat(), folder.path());
    assert_eq!(code(&judged), Some(3), "what has no result comes first: {}", error(&judged));
    let one = [&asked[..5], &["--output", "one.glb"]].concat();
    assert_eq!(code(&retargetd(&one, folder.path())), Some(2), "all in one file");
}

#[test]
fn the_exit_code_tells_the_verdict_to_who_asks() {
    let folder = folder();
    std::fs::write(folder.path().join("pelvis.json"), r#"{"ops": [{"op": "pelvis"}]}"#).expect("a config");
    let run = |more: &[&str]| {
        let asked = [&FILES[..], &["--config", "pelvis.json", "--output", "out.glb"], more].concat();
        retargetd(&asked, folder.path())
    };
    assert_eq!(code(&run(&[])), Some(0), "nobody asked");
    let worse = run(&["--fail-on", "fail", "--json"]);
    assert_eq!(code(&worse), Some(5), "{}", error(&worse));
    assert!(error(&worse).contains("the verdict is fail") && error(&worse).contains("coverage "), "{}", error(&worse));
    let told = object(&worse);
    assert_eq!(told["verdict"], "fail", "one object: {told}");
    assert!(told["coverage"].is_number() && folder.path().join("out.glb").exists(), "the result is there: {told}");
}

#[test]
fn every_command_speaks_to_programs() {
    let folder = folder();
    let commands: [&[&str]; 12] = [
        &["inspect", "walk.glb"],
        &["suggest", "--source", "walk.glb", "--target", "mannequin.glb"],
        &["joint-table", "--source", "walk.glb", "--target", "mannequin.glb"],
        &["explain", "--source", "walk.glb", "--target", "mannequin.glb", "--frame", "1", "--joint", "pelvis"],
        &["pose", "--input", "mannequin.glb", "--output", "posed.glb"],
        &["preview", "walk.glb", "--size", "64", "--output", "walk.png"],
        &["samples", "--output", "samples"],
        &["openapi"],
        &["openapi", "--problems"],
        &["keys", "list", "--data", "keys", "--new"],
        &["completions", "bash"],
        &["man"],
    ];
    for command in commands {
        let output = retargetd(&[command, &["--json"]].concat(), folder.path());
        assert_eq!(code(&output), Some(0), "{command:?}: {}", error(&output));
        assert!(object(&output).is_object(), "{command:?}");
    }
    let refused = retargetd(&["inspect", "missing.glb", "--json"], folder.path());
    assert_eq!(object(&refused)["error"]["exit_code"], 3, "an error too");
    let misread = retargetd(&["inspect", "--jsno", "--json"], folder.path());
    assert_eq!(object(&misread)["error"]["exit_code"], 2, "also of the command line itself");
    let quiet = retargetd(&[&FILES[..], &["--output", "out.glb", "-q"]].concat(), folder.path());
    assert!(code(&quiet) == Some(0) && error(&quiet).is_empty(), "{}", error(&quiet));
}

#[test]
fn shells_and_manuals_know_the_commands() {
    let folder = folder();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = retargetd(&["completions", shell], folder.path());
        let text = String::from_utf8_lossy(&script.stdout).into_owned();
        assert!(code(&script) == Some(0) && text.contains("target-rest"), "{shell}: {}", error(&script));
    }
    let man = retargetd(&["man", "--output", "man"], folder.path());
    assert_eq!(code(&man), Some(0), "{}", error(&man));
    let page = std::fs::read_to_string(folder.path().join("man/retargetd-retarget.1")).expect("a page");
    assert!(page.contains(".TH") && page.contains("fail"), "the manual of a command");
}

/// What a command refuses for its size, it can be told to take: by the names that the service has for it.
#[test]
fn limits_of_files_can_be_changed() {
    let folder = folder();
    let few = ["inspect", "walk.glb", "--max-frames-per-clip", "10"];
    let refused = retargetd(&few, folder.path());
    let text = error(&refused);
    assert_eq!(code(&refused), Some(3), "{text}");
    assert!(text.contains("'frames_per_clip' is 10"), "which limit: {text}");
    let fix = "raise the limit: --max-frames-per-clip, or RETARGETD_MAX_FRAMES_PER_CLIP";
    assert!(text.contains(fix) && !text.contains("operator"), "how to raise it: {text}");
    assert_eq!(text.lines().count(), 2, "{text}");

    let by_variable = |bytes: &str, more: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        let arguments = [&FILES[..], &["--output", "out.glb", "--force"], more].concat();
        command.args(arguments).current_dir(folder.path()).env("RETARGETD_MAX_FILE_BYTES", bytes);
        command.output().expect("the binary runs")
    };
    assert_eq!(code(&by_variable("1000", &[])), Some(3), "the variable of the service counts");
    let raised = by_variable("1000", &["--max-file-bytes", "1GiB"]);
    assert_eq!(code(&raised), Some(0), "a flag wins: {}", error(&raised));
    let wrong = by_variable("many", &[]);
    let text = error(&wrong);
    assert_eq!(code(&wrong), Some(2), "{text}");
    assert!(text.contains("RETARGETD_MAX_FILE_BYTES") && text.contains("'many'"), "what is wrong: {text}");
}

#[test]
fn the_check_of_a_config_tells_that_it_is_empty() {
    let folder = folder();
    std::fs::write(folder.path().join("empty.json"), b" \n").expect("a file");
    let checked = retargetd(&["check-config", "empty.json"], folder.path());
    let text = error(&checked);
    assert_eq!(code(&checked), Some(0), "{text}");
    assert!(text.contains("empty_config") && text.contains("{} where it is meant"), "{text}");
}
