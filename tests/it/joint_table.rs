//! Joint tables: what spreadsheets write is read, errors name line and column, a table to start from is written.

use std::process::{Command, Stdio};

use retargetd::{
    retarget::{TableRow, parse_document, write_table},
    samples,
};
use serde_json::{Value, json};

fn rows(text: &str) -> Value {
    parse_document(text.as_bytes()).expect("a table")["ops"][1]["rows"].clone()
}

#[test]
fn what_spreadsheets_write_is_read() {
    let expected = json!([
        {"source": "Hips", "target": "pelvis", "position": true, "rotation": true, "position_gain": 0.5},
        {"source": ["Fore, Arm", "Hand"], "target": "lowerarm_l", "rotation": true, "axis_order": "x-zy",
         "axis_offset": [0.0, 0.0, 45.0], "space": "local"},
    ]);
    let german = "\u{feff}# Schulter bis Hand\r\nSource;Target;Source End;Position;Rotation;Position Gain;Axis-Order;\
                  AXIS_OFFSET_Z;space\r\nHips;pelvis;;x;1;0,5;;;\r\n\r\n\"Fore, Arm\";lowerarm_l;Hand;;yes;;x-zy;45,0;local\r\n";
    assert_eq!(rows(german), expected, "semicolons, decimal commas, a byte-order mark, comments");
    let english = "target,source,source_end,position,rotation,position_gain,axis_order,axis_offset_z,space\n\
                   pelvis,Hips,,true,yes,0.5\nlowerarm_l,\"Fore, Arm\",Hand,,YES,,x-zy,45.0,local\n";
    assert_eq!(rows(english), expected, "commas, columns in another order, short rows");
    let tabs = "source\ttarget\tposition\nHips\tpelvis\tno\n";
    assert_eq!(rows(tabs), json!([{"source": "Hips", "target": "pelvis", "position": false}]), "tabs");
}

#[test]
fn what_is_wrong_is_named_by_line_and_column() {
    let text =
        "source;target;rotation;rotation_gain;gian\n\nHips;pelvis;maybe;1.2.3\n;spine;yes;1\na;b;yes;1;;extra;more\n";
    let error = parse_document(text.as_bytes()).expect_err("it is refused");
    let found: Vec<(&str, &str)> =
        error.fields.iter().map(|field| (field.pointer.as_str(), field.detail.as_str())).collect();
    let expected = [
        ("/line/1/5", "line 1, column 5: there is no column 'gian'"),
        ("/line/3/rotation", "line 3, column 3 (rotation): 'maybe' is neither yes nor no"),
        ("/line/3/rotation_gain", "line 3, column 4 (rotation_gain): '1.2.3' is no number"),
        ("/line/4/source", "line 4, column 1 (source): a row names a source and a target"),
        ("/line/5/?", "line 5, column 6 (?): 'extra' is beyond the 5 columns of the header"),
        ("/line/5/?", "line 5, column 7 (?): 'more' is beyond the 5 columns of the header"),
    ];
    assert_eq!(found, expected);
    let open = parse_document(b"source,target\n\"a,b\n").expect_err("a quote is open");
    assert!(open.detail.contains("line 2"), "{open}");
    let ambiguous = parse_document(b"source,target,rotation_gain\na,b,\"0,5\"\n").expect_err("a comma in a number");
    assert_eq!(ambiguous.fields[0].pointer, "/line/2/rotation_gain", "commas separate here");
}

#[test]
fn yaml_and_json_are_no_tables() {
    let yaml = parse_document(b"source: {root: Hips}\ntarget: {root: pelvis}\n").expect("YAML");
    assert_eq!(yaml["source"]["root"], "Hips");
    let one_line = parse_document(b"{\"source\": {}, \"target\": {}}").expect("JSON");
    assert_eq!(one_line, json!({"source": {}, "target": {}}));
}

#[test]
fn a_written_table_is_read_back() {
    let row = |source: &str, position| TableRow { source: source.into(), target: "t; \"x\"".into(), position };
    let text = write_table(&[row("# a", true), row(" b", false)]);
    let read = rows(&text);
    assert_eq!(read[0], json!({"source": "# a", "target": "t; \"x\"", "position": true, "rotation": true}));
    assert_eq!(read[1]["source"], "b", "space around a name is not kept");
}

#[test]
fn a_table_to_start_from() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("walk.glb"), samples::walk_clip()).expect("the walk");
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("the mannequin");
    let run = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["joint-table", "--source", "walk.glb", "--target", "mannequin.glb"])
            .args(arguments)
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .output()
            .expect("the binary runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).expect("text")
    };
    let csv = run(&[]);
    let table = rows(&csv);
    let row = |target: &str| table.as_array().expect("rows").iter().find(|row| row["target"] == target).cloned();
    let pelvis = row("pelvis").expect("the pelvis");
    assert_eq!((&pelvis["source"], &pelvis["position"]), (&json!("mixamorig:Hips"), &json!(true)));
    let forearm = row("lowerarm_l").expect("a forearm");
    assert_eq!((&forearm["source"], &forearm["position"]), (&json!("mixamorig:LeftForeArm"), &json!(false)));
    run(&["--output", "table.json"]);
    let text = std::fs::read(folder.path().join("table.json")).expect("a config");
    let config: Value = serde_json::from_slice(&text).expect("JSON");
    assert_eq!(config["ops"][1]["rows"], table, "the same as a config");

    // As a config it does by rows about what is done without one.
    std::fs::write(folder.path().join("table.csv"), csv).expect("the table");
    let poses = |config: Option<&str>| -> Value {
        let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
        command.args(["retarget", "--source", "walk.glb", "--target", "mannequin.glb", "--output", "out.json"]);
        command.args(config.iter().flat_map(|config| ["--config", config]));
        let output = command.current_dir(folder.path()).stdin(Stdio::null()).output().expect("the binary runs");
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&std::fs::read(folder.path().join("out.json")).expect("poses")).expect("JSON")
    };
    let (by_csv, by_json) = (poses(Some("table.csv")), poses(Some("table.json")));
    assert_eq!(by_csv["rotations"], by_json["rotations"], "both say the same");
    let names = by_csv["joint_names"].as_array().expect("names");
    let thigh = names.iter().position(|name| name == "thigh_l").expect("a thigh");
    let at = |frame: usize| by_csv["rotations"][frame][thigh].clone();
    assert_ne!(at(0), at(15), "the thigh walks");
}
