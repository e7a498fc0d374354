//! What people do with the page, in headless Chromium.

use std::{path::Path, process::Command};

use retargetd::samples;
use serde_json::Value;

use super::studio_script;
use crate::{service_process::ServiceProcess, support::corpus_file};

fn serve(data: &Path, flags: &[&str]) -> ServiceProcess {
    let mut command = Command::new(env!("CARGO_BIN_EXE_retargetd"));
    command.args(["serve", "--listen", "127.0.0.1:0", "--log", "warn", "--data"]).arg(data).args(flags);
    ServiceProcess::listening(&mut command)
}

#[test]
fn the_sample_plays_and_nothing_leaves_the_origin() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    if let Some(told) = studio_script("first.mjs", &[&server.url]) {
        let first: &Value = told.last().expect("what was measured");
        // Debug builds on a busy machine are far slower than what people run; docs/guide/studio.md has the figures.
        assert!(first["first_frame_ms"].as_f64().is_some_and(|milliseconds| milliseconds < 15_000.0), "{first}");
    }
}

#[test]
fn people_correct_and_decide() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let at = |name: &str| folder.path().join(name);
    if studio_script("journeys.mjs", &[&server.url, &folder.path().to_string_lossy()]).is_none() {
        return;
    }
    for (name, bytes) in [("walk.glb", samples::walk_clip()), ("mannequin.glb", samples::mannequin())] {
        std::fs::write(at(name), bytes).expect("written");
    }
    for ending in ["glb", "bvh"] {
        let output = at(&format!("command.{ending}"));
        let status = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args([
                "retarget",
                "--source",
                "walk.glb",
                "--target",
                "mannequin.glb",
                "--config",
                "config.json",
                "--output",
            ])
            .arg(&output)
            .current_dir(folder.path())
            .status();
        assert!(status.expect("it runs").success(), "the exported config is understood");
        let (page, command) = (std::fs::read(at(&format!("page.{ending}"))), std::fs::read(output));
        assert!(page.expect("downloaded") == command.expect("written"), "{ending}: byte for byte the same");
    }
}

#[test]
fn many_clips_go_onto_many_characters() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let write = |name: &str, bytes: Vec<u8>| std::fs::write(folder.path().join(name), bytes).expect("written");
    let (walk, mannequin) = (samples::walk_clip(), samples::mannequin());
    // The same bytes are one asset, so each has something of its own at its end.
    let named = |bytes: &[u8], name: &str| renamed(bytes, name);
    for (index, name) in ["walk_a.glb", "walk_c.glb"].into_iter().enumerate() {
        write(name, named(&walk, &format!("walk {index}")));
    }
    write("edit.json", b"{}".to_vec());
    let status = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["edit", "--input", "walk_a.glb", "--config", "edit.json", "--output", "walk_b.bvh"])
        .current_dir(folder.path())
        .status();
    assert!(status.expect("it runs").success(), "a BVH of the walk");
    for name in ["one.glb", "two.glb", "three.glb", "four.glb"] {
        write(name, named(&mannequin, name));
    }
    studio_script("batch.mjs", &[&server.url, &folder.path().to_string_lossy()]);
}

/// A GLB whose generator is another one.
fn renamed(glb: &[u8], generator: &str) -> Vec<u8> {
    const HEADER: usize = 20;
    let length = u32::from_le_bytes([glb[12], glb[13], glb[14], glb[15]]) as usize;
    let mut document: Value = serde_json::from_slice(&glb[HEADER..HEADER + length]).expect("JSON");
    document["asset"]["generator"] = generator.into();
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let rest = &glb[HEADER + length..];
    let total = (HEADER + text.len() + rest.len()) as u32;
    let mut bytes = glb[..8].to_vec();
    bytes.extend(total.to_le_bytes());
    bytes.extend((text.len() as u32).to_le_bytes());
    bytes.extend(b"JSON");
    bytes.extend(text);
    bytes.extend(rest);
    bytes
}

#[test]
fn who_needs_a_key_is_asked_for_one() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let made = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args(["keys", "create", "--new", "animator", "--data"])
        .arg(data.path())
        .output()
        .expect("it runs");
    let text = String::from_utf8_lossy(&made.stdout).into_owned();
    let key = text.split_whitespace().find(|word| word.starts_with("rtk_")).unwrap_or_else(|| panic!("a key: {text}"));
    let server = serve(data.path(), &["--authentication", "keys"]);
    studio_script("keys.mjs", &[&server.url, key]);
}

#[test]
fn files_of_people_are_dropped() {
    let pairs = [
        ("bvh/bandai-namco/dataset-1_walk_normal_001.bvh", "vrm1/makehuman_body_vrm1.vrm"),
        ("mixamo/fbx/walking_noskin.fbx", "biped/rocketbox_male_adult_01.fbx"),
    ];
    let mut arguments = Vec::new();
    for path in pairs.iter().flat_map(|(clip, character)| [clip, character]) {
        let Some(file) = corpus_file(path) else { return };
        arguments.push(file.to_string_lossy().into_owned());
    }
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let all: Vec<&str> = std::iter::once(server.url.as_str()).chain(arguments.iter().map(String::as_str)).collect();
    studio_script("dropped.mjs", &all);
}

#[test]
fn files_of_every_format_are_shown_on_both_sides() {
    let files = [
        "bvh/fair1/dab_zup.bvh",
        "cc0-stylised/kenney_medium_maya.fbx",
        "vrm0/catbot.vrm",
        "vrma/idle_loop.vrma",
        "smpl/humanml3d_012314_joints22.npy",
    ];
    let Some(files) = files.into_iter().map(corpus_file).collect::<Option<Vec<_>>>() else { return };
    let files: Vec<String> = files.iter().map(|file| file.to_string_lossy().into_owned()).collect();
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let all: Vec<&str> = std::iter::once(server.url.as_str()).chain(files.iter().map(String::as_str)).collect();
    studio_script("formats.mjs", &all);
}

#[test]
fn another_page_shows_it_and_talks_with_it() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    studio_script("embed.mjs", &[&server.url]);
}
