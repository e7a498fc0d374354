//! The studio: its files, and what people do with it in headless Chromium against the binary with the real engine.

mod journeys;

use std::{path::Path, process::Command};

use retargetd::{
    engine::{DisplayOptions, Limits, NamedBytes, display},
    model::Control,
};
use serde_json::{Value, json};

use crate::support::{corpus_file, gltf_json, validate_gltf};

/// One file of each format that is read, and those that are hard to show: compressed, stretched, without a skin, in centimeters, lying down.
const SHOWN: [&str; 26] = [
    "bvh/fair1/dab_zup.bvh",
    "bvh/bandai-namco/dataset-1_walk_normal_001.bvh",
    "bvh/rokoko/jesse_dance.bvh",
    "cc0-stylised/kaykit_knight.glb",
    "cc0-stylised/kenney_medium_maya.fbx",
    "cc0-stylised/kenney_platformer_noskin.glb",
    "cc0-stylised/quaternius_adventurer.gltf",
    "cc0-stylised/quaternius_orc_draco.glb",
    "cc0-stylised/robot_expressive.glb",
    "creatures/Fox.glb",
    "creatures/spider_noskin.fbx",
    "khronos/CesiumMan.glb",
    "mixamo/gltf/Xbot.glb",
    "mixamo/gltf/michelle_meshopt.glb",
    "odd-transforms/armature_nonuniform_scale.glb",
    "odd-transforms/armature_rotated_offset_001.glb",
    "poser-daz/daz_g8_names_apose.glb",
    "readyplayerme/rpm_avatar_a.glb",
    "unreal/ue4_names_apose.glb",
    "vrm0/catbot.vrm",
    "vrm1/makehuman_body_vrm1.vrm",
    "biped/rocketbox_male_adult_01.fbx",
    "vrma/idle_loop.vrma",
    "smpl/aistpp_gBR_d04_smpl24_yup.npz",
    "smpl/humanml3d_012314_joints22.npy",
    "decentraland/walk.glb",
];

/// Runs a script of `tests/tools/studio` and gives the lines of JSON that it prints. Nothing, said on standard error, where it cannot run.
fn studio_script(name: &str, arguments: &[&str]) -> Option<Vec<Value>> {
    crate::support::browser_script(name)?;
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/studio");
    assert!(
        tool.join("node_modules/playwright-core").exists(),
        "tools are not installed: run 'npm ci --prefix tests/tools/studio', or set RETARGETD_SKIP_NODE=1"
    );
    let output = Command::new("node").arg(tool.join(name)).args(arguments).output().expect("node runs");
    let (out, errors) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{name}: {out}\n{errors}");
    Some(out.lines().filter_map(|line| serde_json::from_str(line).ok()).collect())
}

fn shown(name: &str, bytes: &[u8]) -> Vec<u8> {
    let options = DisplayOptions { clip: None, mesh: true };
    display(NamedBytes { name, bytes }, &options, &Limits::default(), &Control::new())
        .unwrap_or_else(|failure| panic!("{name}: {failure}"))
}

#[test]
fn files_of_every_kind_become_plain_glb() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut files = Vec::new();
    for path in SHOWN {
        let Some(file) = corpus_file(path) else { return };
        let bytes = std::fs::read(&file).expect("readable");
        let bytes = crate::support::with_buffers(&bytes, &file);
        let glb = shown(&file.file_name().expect("a name").to_string_lossy(), &bytes);
        let document = gltf_json(&glb);
        assert!(document["extensionsUsed"].is_null(), "{path}: nothing but the core of glTF");
        assert!(document["meshes"].as_array().is_some_and(|meshes| !meshes.is_empty()), "{path}: it can be seen");
        let written = folder.path().join(format!("{}.glb", path.replace('/', "_")));
        std::fs::write(&written, glb).expect("written");
        files.push(written);
    }
    let paths: Vec<&Path> = files.iter().map(std::path::PathBuf::as_path).collect();
    let problems: Vec<String> = validate_gltf(&paths)
        .into_iter()
        .flatten()
        .filter(|(_, report)| report["errors"] != json!(0))
        .map(|(file, report)| format!("{}: {report}", file.display()))
        .collect();
    assert!(problems.is_empty(), "the validator finds no error:\n{}", problems.join("\n"));
}

#[test]
fn types_of_the_modules_are_right() {
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/studio");
    if studio_node(&tool, "typescript").is_none() {
        return;
    }
    let output = Command::new("node").arg(tool.join("check_types.mjs")).output().expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
}

#[test]
fn the_bundle_is_what_it_says_to_be() {
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/studio_vendor");
    let vendor = Path::new(env!("CARGO_MANIFEST_DIR")).join("studio/vendor");
    let version: Value =
        serde_json::from_slice(&std::fs::read(vendor.join("VERSION.json")).expect("readable")).expect("JSON");
    let bundle = std::fs::read(vendor.join("three.js")).expect("readable");
    assert_eq!(version["sha256"], crate::support::sha256_of(&bundle), "studio/vendor/three.js is that of VERSION.json");
    if studio_node(&tool, "esbuild").is_none() {
        return;
    }
    let output = Command::new("node").arg(tool.join("build.mjs")).arg("--digest").output().expect("node runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(version["sha256"], String::from_utf8_lossy(&output.stdout).trim(), "built anew, it is the same");
}

/// A folder of tools whose packages are installed; nothing, said on standard error, when `RETARGETD_SKIP_NODE=1`.
fn studio_node(tool: &Path, package: &str) -> Option<()> {
    if !crate::support::may_use_node(package) {
        return None;
    }
    let folder = tool.display();
    assert!(
        tool.join("node_modules").join(package).exists(),
        "{package} is not installed: run 'npm ci --prefix {folder}', or set RETARGETD_SKIP_NODE=1"
    );
    Some(())
}
