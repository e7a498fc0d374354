//! Custom properties that a file animates, on their way through the command line. No file of the corpus turns one, so that one of
//! them gets keys here.

use std::path::Path;

use serde_json::{Value, json};

use super::{code, error, retargetd};
use crate::support::{corpus_file, gltf_json};

const FILE: &str = "fbx-semantics/maya_game_sausage_7500_ascii_wiggle.fbx";

/// The file with a property `grip` on its first joint, which goes from 0 to 1.9 in 20 keys; nothing where there is no corpus.
pub(crate) fn with_a_property() -> Option<String> {
    let text = std::fs::read_to_string(corpus_file(FILE)?).expect("an FBX in text");
    let values: Vec<String> = (0..20).map(|key| format!("{:.1}", f64::from(key) / 10.0)).collect();
    let ones = vec!["1"; 20].join(",");
    let text = text
        .replace("\"lockInfluenceWeights\", \"Bool\", \"\", \"A+U\",0", "\"grip\", \"Number\", \"\", \"A+U\",0")
        .replace("\"d|lockInfluenceWeights\", \"Bool\"", "\"d|grip\", \"Number\"")
        .replace("lockInfluenceWeights", "grip")
        .replace(
            "C: \"OP\",2516914037264,2520543562192, \"d|Visibility\"",
            "C: \"OP\",2516914037264,2520543546592, \"d|grip\"",
        );
    let (before, curve) = text.split_once("AnimationCurve: 2516914037264").expect("the curve");
    let curve = curve.replacen(&format!("a: {ones}"), &format!("a: {}", values.join(",")), 1);
    assert!(before.len() < text.len() && curve.contains(",1.9"), "the file is as it was");
    Some(format!("{before}AnimationCurve: 2516914037264{curve}"))
}

/// The values of a curve in pose arrays; nothing where they have none of that name.
pub(crate) fn values_of(poses: &Value, name: &str) -> Option<Vec<f64>> {
    let names = poses["morph_names"].as_array()?;
    let index = names.iter().position(|other| other == name)?;
    let rows = poses["morph_weights"].as_array().expect("frames");
    Some(rows.iter().map(|row| row[index].as_f64().expect("a number")).collect())
}

fn retargeted(folder: &Path, config: &Value, output: &str) -> Value {
    let text = with_a_property().expect("the corpus was there");
    std::fs::write(folder.join("sausage.fbx"), text).expect("the file");
    std::fs::write(folder.join("config.json"), config.to_string()).expect("the config");
    let arguments = ["retarget", "--source", "sausage.fbx", "--target", "sausage.fbx", "--config", "config.json"];
    let outputs = ["--output", output, "--report", "report.json"];
    let ran = retargetd(&[&arguments[..], &outputs].concat(), folder);
    assert_eq!(code(&ran), Some(0), "{}", error(&ran));
    serde_json::from_slice(&std::fs::read(folder.join("report.json")).expect("the report")).expect("JSON")
}

fn poses(folder: &Path, config: &Value) -> Value {
    retargeted(folder, config, "out.json");
    serde_json::from_slice(&std::fs::read(folder.join("out.json")).expect("the poses")).expect("JSON")
}

#[test]
fn a_property_goes_along_and_is_changed_as_the_rows_say() {
    if corpus_file(FILE).is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    let own = values_of(&poses(folder.path(), &json!({})), "grip").expect("it goes along when nobody says");
    assert!(own[0].abs() < 1e-6 && (own[19] - 1.9).abs() < 1e-6 && own.len() == 20, "{own:?}");

    let rows = json!([
        {"source": "grip", "target": "hold", "points": [[0, 1], [1, 0]], "gain": 2, "offset": 0.5, "clamp": [0.5, 2.0]},
        {"source": "grip", "target": "twice", "gain": 2}
    ]);
    let changed = poses(folder.path(), &json!({"ops": [{"op": "fk"}, {"op": "curves", "rows": rows}]}));
    let hold = values_of(&changed, "hold").expect("renamed");
    for (own, hold) in own.iter().zip(&hold) {
        let wanted = (2.0 * (1.0 - own).max(0.0) + 0.5).clamp(0.5, 2.0);
        assert!((hold - wanted).abs() < 1e-6, "{own} becomes {hold}, wanted {wanted}");
    }
    assert!(
        values_of(&changed, "twice").is_some_and(|twice| (twice[10] - 2.0).abs() < 1e-6),
        "a second row of one source"
    );
    assert_eq!(values_of(&changed, "grip"), None, "what a row names is what the row makes of it");

    let dropped = json!({"ops": [{"op": "fk"}, {"op": "curves", "others": "drop"}]});
    assert_eq!(values_of(&poses(folder.path(), &dropped), "grip"), None, "dropped");
    let without = json!({"ops": [{"op": "fk"}]});
    assert_eq!(values_of(&poses(folder.path(), &without), "grip"), None, "no op, no curve");
}

#[test]
fn gltf_has_properties_as_extras_and_what_cannot_hold_them_says_so() {
    if corpus_file(FILE).is_none() {
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    retargeted(folder.path(), &json!({}), "out.glb");
    let document = gltf_json(&std::fs::read(folder.path().join("out.glb")).expect("a GLB"));
    let curves = &document["animations"][0]["extras"]["curves"];
    let lists = [&curves["times_seconds"], &curves["values"]["grip"]].map(|list| list.as_array().map(Vec::len));
    assert_eq!(lists, [Some(20), Some(20)], "{curves}");
    let arguments = ["retarget", "--source", "out.glb", "--target", "out.glb", "--output", "back.json"];
    let ran = retargetd(&arguments, folder.path());
    assert_eq!(code(&ran), Some(0), "{}", error(&ran));
    let back = serde_json::from_slice(&std::fs::read(folder.path().join("back.json")).expect("the poses"));
    let back = values_of(&back.expect("JSON"), "grip").expect("a source has the curves of its extras");
    assert!(
        back.len() == 20 && back.iter().enumerate().all(|(frame, value)| (value - frame as f64 / 10.0).abs() < 1e-6),
        "as they were: {back:?}"
    );
    let report = retargeted(folder.path(), &json!({}), "out.bvh");
    let codes: Vec<&str> = report["warnings"]
        .as_array()
        .expect("warnings")
        .iter()
        .filter_map(|warning| warning["code"].as_str())
        .collect();
    assert!(codes.contains(&"curves_not_written"), "{codes:?}");
}

#[test]
fn rows_that_make_no_sense_are_refused_where_they_stand() {
    let Some(text) = with_a_property() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("sausage.fbx"), text).expect("the file");
    for (row, pointer) in [
        (json!({"source": "gripp"}), "/ops/1/rows/0/source"),
        (json!({"source": "grip", "clamp": [1, 0]}), "/ops/1/rows/0/clamp"),
        (json!({"source": "grip", "points": [[1, 0], [0, 1]]}), "/ops/1/rows/0/points"),
        (json!({"source": "grip", "target": ""}), "/ops/1/rows/0/target"),
    ] {
        let config = json!({"ops": [{"op": "fk"}, {"op": "curves", "rows": [row]}]});
        std::fs::write(folder.path().join("config.json"), config.to_string()).expect("the config");
        let arguments = ["--source", "sausage.fbx", "--target", "sausage.fbx", "--config", "config.json"];
        let ran = retargetd(&[&["retarget"], &arguments[..], &["--output", "out.glb"]].concat(), folder.path());
        assert_eq!(code(&ran), Some(3), "{}", error(&ran));
        assert!(error(&ran).contains(pointer), "{pointer}: {}", error(&ran));
    }
}
