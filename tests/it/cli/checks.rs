//! `check-config`, `suggest`, and inputs in each other's place.

use serde_json::{Value, json};

use super::*;

fn write(folder: &TempDir, name: &str, text: &str) {
    std::fs::write(folder.path().join(name), text).expect("written");
}

fn output(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

const FILES: [&str; 4] = ["--source", "walk.glb", "--target", "mannequin.glb"];

fn with_files(first: &[&str], rest: &[&str], folder: &TempDir) -> Output {
    retargetd(&[first, &FILES[..], rest].concat(), folder.path())
}

#[test]
fn a_config_is_checked_by_itself() {
    let folder = folder();
    write(&folder, "good.yaml", "align: off\n");
    let good = retargetd(&["check-config", "good.yaml", "--json"], folder.path());
    assert_eq!(code(&good), Some(0), "{}", error(&good));
    let spec: Value = serde_json::from_slice(&good.stdout).expect("one JSON object");
    assert_eq!((&spec["align"], &spec["report"]), (&json!("off"), &json!("summary")), "as it is understood");
    write(&folder, "bad.json", r#"{"ops": [{"op": "pelvs"}], "sorce": {}, "align": "direction"}"#);
    let bad = retargetd(&["check-config", "bad.json"], folder.path());
    assert_eq!(code(&bad), Some(3), "{}", error(&bad));
    let text = error(&bad);
    for part in ["/ops/0/op", "'pelvis'", "/sorce", "'source'"] {
        assert!(text.contains(part), "all at once, with the nearest names: no {part} in {text}");
    }
}

#[test]
fn an_empty_config_is_told() {
    let folder = folder();
    write(&folder, "empty.json", "");
    write(&folder, "meant.json", "{}");
    let retarget = |config| {
        let made =
            with_files(&["retarget"], &["--config", config, "--output", "out.glb", "--report", "r.json"], &folder);
        assert_eq!(code(&made), Some(0), "{}", error(&made));
        let report: Value =
            serde_json::from_slice(&std::fs::read(folder.path().join("r.json")).expect("a report")).expect("JSON");
        report["warnings"].as_array().expect("warnings").iter().any(|warning| warning["code"] == "empty_config")
    };
    assert!(retarget("empty.json"), "zero bytes are no config that somebody wrote");
    assert!(!retarget("meant.json"), "an empty object is one");
}

#[test]
fn a_config_is_checked_against_two_files() {
    let folder = folder();
    let cases = [
        (r#"{"clip": "Wlak"}"#, "/clip: the source file has no clip 'Wlak'; its clips are: 'Walk'", "Walk"),
        (r#"{"clip": 4}"#, "/clip: the source file has no clip 4; it has one, which is clip 0: 'Walk'", "inspect"),
        (r#"{"target": {"root": "pelvos"}}"#, "/target/root: the target skeleton has no joint 'pelvos'", "pelvis"),
        (r#"{"target": {"roles": {"left_hnd": "hand_l"}}}"#, "/target/roles/left_hnd: there is no role", "left_hand"),
    ];
    for (config, message, hint) in cases {
        write(&folder, "config.json", config);
        let refused = with_files(&["check-config", "config.json"], &[], &folder);
        assert_eq!(code(&refused), Some(3), "{config}: {}", error(&refused));
        let text = error(&refused);
        assert!(text.contains(message), "{config}: {text}");
        let told = text.lines().find(|line| line.starts_with("hint: ")).unwrap_or_default();
        assert!(told.contains(hint), "{config}: {text}");
    }
    write(&folder, "config.json", "{}");
    let fits = with_files(&["check-config", "config.json"], &[], &folder);
    assert_eq!(code(&fits), Some(0), "{}", error(&fits));
    assert!(output(&fits).contains("lowerarm_l") && output(&fits).contains("left_forearm"), "what drives what");
    let half = retargetd(&["check-config", "config.json", "--source", "walk.glb"], folder.path());
    assert_eq!(code(&half), Some(2), "one file is no pair: {}", error(&half));
}

#[test]
fn a_suggestion_used_as_the_config_gives_the_same_result() {
    let folder = folder();
    let suggested = with_files(&["suggest"], &["--output", "mapping.json", "--json"], &folder);
    assert_eq!(code(&suggested), Some(0), "{}", error(&suggested));
    let proposal: Value = serde_json::from_slice(&suggested.stdout).expect("one JSON object");
    let file: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("mapping.json")).expect("a file")).expect("JSON");
    assert_eq!(file, proposal["resolved_spec"], "the file is the config");
    let joints = proposal["joints"].as_array().expect("a list");
    assert_eq!(joints.len() as u64, proposal["counts"]["target_joints"].as_u64().expect("a number") + 1, "all nodes");
    let forearm = joints.iter().find(|joint| joint["joint"] == "lowerarm_l").expect("an elbow");
    assert_eq!(forearm["driver"], "chain", "{forearm}");
    assert_eq!(forearm["sources"], json!([{"joint": "mixamorig:LeftForeArm", "weight": 1.0}]), "{forearm}");
    let twist = joints.iter().find(|joint| joint["joint"] == "lowerarm_twist_01_l").expect("a helper");
    assert_eq!(twist["driver"], "twist", "{twist}");
    let roles = proposal["roles"].as_array().expect("a list");
    let role = roles.iter().find(|role| role["role"] == "left_forearm").expect("a role");
    assert!(role["confidence"].as_f64() > Some(0.5) && role["target_details"]["reasons"].is_array(), "{role}");
    for (config, name) in [(&[][..], "plain.npz"), (&["--config", "mapping.json"], "mapped.npz")] {
        let made = with_files(&["retarget"], &[config, &["--output", name]].concat(), &folder);
        assert_eq!(code(&made), Some(0), "{}", error(&made));
    }
    let read = |name: &str| std::fs::read(folder.path().join(name)).expect("a file");
    assert!(read("plain.npz") == read("mapped.npz"), "byte for byte");
}

#[test]
fn a_source_without_animation_can_be_mapped() {
    let folder = folder();
    let arguments = ["suggest", "--source", "mannequin.glb", "--target", "walk.glb", "--json"];
    let suggested = retargetd(&arguments, folder.path());
    assert_eq!(code(&suggested), Some(0), "{}", error(&suggested));
    let proposal: Value = serde_json::from_slice(&suggested.stdout).expect("one JSON object");
    let codes: Vec<&str> = proposal["warnings"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|warning| warning["code"].as_str())
        .collect();
    assert!(codes.contains(&"no_animation"), "it is said: {codes:?}");
    assert!(proposal["counts"]["driven_joints"].as_u64() > Some(20), "{}", proposal["counts"]);
}

#[test]
fn inputs_in_each_others_place_are_told() {
    let folder = folder();
    write(&folder, "config.json", r#"{"align": "off"}"#);
    let ask = |arguments: &[&str]| {
        let made = retargetd(&[&["retarget", "--output", "out.glb"], arguments].concat(), folder.path());
        assert_eq!(code(&made), Some(3), "{arguments:?}: {}", error(&made));
        error(&made)
    };
    let swapped = ask(&["--source", "mannequin.glb", "--target", "walk.glb"]);
    assert!(swapped.contains("no animation") && swapped.contains("are source and target swapped?"), "{swapped}");
    let config = ask(&["--source", "config.json", "--target", "mannequin.glb"]);
    assert!(config.contains("error: source config.json") && config.contains("this is a retarget config"), "{config}");
    let model = ask(&[&FILES[..], &["--config", "mannequin.glb"]].concat());
    assert!(model.contains("error: config mannequin.glb: this is not a config but a file with joints"), "{model}");
    let rests = ask(&[&FILES[..], &["--source-rest", "mannequin.glb", "--target-rest", "walk.glb"]].concat());
    assert!(rests.contains("error: source_rest mannequin.glb"), "{rests}");
    assert!(rests.contains("are source_rest and target_rest swapped?"), "{rests}");
}

#[test]
fn rigs_and_presets_are_files_on_the_command_line() {
    let folder = folder();
    write(
        &folder,
        "rig.yaml",
        "name: ours\nkind: biped\nroles: {pelvis: [pelvis], head: [head], left_hand: [hand_l]}\n",
    );
    let inspected = retargetd(&["inspect", "mannequin.glb", "--rig", "rig.yaml", "--json"], folder.path());
    assert_eq!(code(&inspected), Some(0), "{}", error(&inspected));
    let inspection: Value = serde_json::from_slice(&inspected.stdout).expect("one JSON object");
    assert_eq!(inspection["rigs"][0]["recognised_as"], "ours", "before the built-in ones");
    write(&folder, "bad.yaml", "name: ours\nkind: bipet\nroles: {pelvis: [pelvis]}\n");
    let refused = retargetd(&["inspect", "mannequin.glb", "--rig", "bad.yaml"], folder.path());
    assert_eq!(code(&refused), Some(3), "{}", error(&refused));
    let told = error(&refused);
    assert!(told.contains("error: rig bad.yaml: /kind") && told.contains("biped"), "{told}");

    write(&folder, "preset.json", r#"{"align": "off", "report": "full"}"#);
    write(&folder, "config.json", r#"{"report": "none"}"#);
    let merged = retargetd(&["check-config", "config.json", "--preset", "preset.json", "--json"], folder.path());
    let spec: Value = serde_json::from_slice(&merged.stdout).expect("one JSON object");
    assert_eq!((&spec["align"], &spec["report"]), (&json!("off"), &json!("none")), "laid over one another");
    let built_in = with_files(&["retarget"], &["--preset", "plain_fk", "--output", "out.glb"], &folder);
    assert_eq!(code(&built_in), Some(0), "{}", error(&built_in));
    let unknown = with_files(&["suggest"], &["--preset", "plain_kf"], &folder);
    assert_eq!(code(&unknown), Some(3), "{}", error(&unknown));
    assert!(error(&unknown).contains("built-in presets are default, plain_fk"), "{}", error(&unknown));
}

#[test]
fn an_input_is_not_written_over_and_the_verdict_is_told() {
    let folder = super::folder();
    let before = std::fs::read(folder.path().join("walk.glb")).expect("the walk");
    let run = |output: &str, more: &[&str]| {
        let mut arguments = vec!["retarget", "--source", "walk.glb", "--target", "mannequin.glb", "--output", output];
        arguments.extend(more);
        super::retargetd(&arguments, folder.path())
    };
    for output in ["walk.glb", "./mannequin.glb"] {
        let refused = run(output, &[]);
        assert_eq!(super::code(&refused), Some(2), "{}", super::error(&refused));
        assert!(super::error(&refused).contains("--force"), "{}", super::error(&refused));
    }
    assert_eq!(std::fs::read(folder.path().join("walk.glb")).expect("the walk"), before, "as it was");
    let done = run("out.glb", &["--no-clobber"]);
    assert_eq!(super::code(&done), Some(0), "{}", super::error(&done));
    assert!(super::error(&done).contains("verdict: "), "{}", super::error(&done));
    assert_eq!(super::code(&run("out.glb", &["--no-clobber"])), Some(2), "it is there already");
    assert_eq!(super::code(&run("out.glb", &[])), Some(0), "a result may be written again");
    assert_eq!(super::code(&run("walk.glb", &["--force"])), Some(0), "asked for");
}
