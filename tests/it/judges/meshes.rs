//! Meshes of an FBX in a GLB: the same vertices in the same places, as three.js moves both files.

use std::{fs, path::Path, process::Command};

use retargetd::engine::Format;
use serde_json::Value;

use super::{MAX_OF_SIZE, answers, retargeted};
use crate::support::{corpus_file, three_script, validate_gltf};

const SOURCE: &str = "mixamo/fbx/walking_noskin.fbx";
/// Characters with skins, shapes, several meshes and materials, pivots, and nodes that are scaled and turned; Y up and Z up.
const TARGETS: [&str; 6] = [
    "mixamo/fbx/ybot_prerotation_skin.fbx",
    "mixamo/cc0/makehuman_mixamo_names_rest_leafbones.fbx",
    "readyplayerme/rpm_avatar.fbx",
    "cc0-stylised/quaternius_alien.fbx",
    "biped/rocketbox_male_adult_01.fbx",
    "unreal/ue4_names_apose_zup_xfwd.fbx",
];

/// What three.js says of pairs of files.
fn vertices(pairs: &[String]) -> Option<Vec<Value>> {
    let output = Command::new("node").arg(three_script("vertices.mjs")?).args(pairs).output().expect("node runs");
    answers(&output, pairs.len())
}

/// The walk on a character, as FBX and as GLB, in two files of a folder.
fn walking(target: &str, folder: &Path, name: &str) -> Option<[std::path::PathBuf; 2]> {
    let source = fs::read(corpus_file(SOURCE)?).expect("a file");
    let bytes = fs::read(corpus_file(target)?).expect("a file");
    let config = r#"{"edit": {"fps": 30, "range": [0, 0.8]}}"#;
    let outcome = retargeted((SOURCE, &source), (target, &bytes), config, &[Format::Fbx, Format::Glb]);
    Some([0, 1].map(|index| {
        let output = &outcome.outputs[index];
        let file = folder.join(format!("{name}.{}", output.format.info().endings[0]));
        fs::write(&file, &output.bytes).expect("a file");
        file
    }))
}

#[test]
fn characters_are_the_same_as_fbx_and_as_glb() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut files = Vec::new();
    for (index, target) in TARGETS.into_iter().enumerate() {
        let Some(written) = walking(target, folder.path(), &index.to_string()) else { return };
        files.push(written);
    }
    let glbs: Vec<&Path> = files.iter().map(|[_, glb]| glb.as_path()).collect();
    if let Some(reports) = validate_gltf(&glbs) {
        for (glb, target) in glbs.iter().zip(TARGETS) {
            let report = &reports[*glb];
            let found = (report["errors"].as_u64(), report["warnings"].as_u64());
            assert_eq!(found, (Some(0), Some(0)), "{target}: {report}");
        }
    }
    let pairs: Vec<String> =
        files.iter().map(|[fbx, glb]| format!("{}={}=0.01", fbx.display(), glb.display())).collect();
    let Some(seen) = vertices(&pairs) else { return };
    for (seen, target) in seen.iter().zip(TARGETS) {
        assert_eq!(seen["error"], Value::Null, "{target}");
        assert!(seen["vertices"][1].as_u64() > Some(500), "{target}: {seen}");
        assert!(seen["apart"].as_f64().is_some_and(|apart| apart < MAX_OF_SIZE), "{target}: {seen}");
    }
}
