//! What people do with the page, in headless Chromium.

use std::{io::Read as _, path::Path, process::Command};

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
fn what_the_page_of_the_api_sends_by_itself_is_taken() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let [source, target, _] = samples::Sample::ALL.map(|sample| {
        let path = folder.path().join(sample.name);
        std::fs::write(&path, sample.bytes()).expect("written");
        path.to_string_lossy().into_owned()
    });
    studio_script("explorer.mjs", &[&server.url, &source, &target]);
}

#[test]
fn people_without_a_mouse_do_the_same() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let write = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("written");
        path.to_string_lossy().into_owned()
    };
    let clip = write("my_walk.glb", &renamed(&samples::walk_clip(), "mine"));
    let character = write("my_mannequin.glb", &renamed(&samples::mannequin(), "mine"));
    let refused = write("notes.bvh", b"this is no motion");
    studio_script("hands_free.mjs", &[&server.url, &folder.path().to_string_lossy(), &clip, &character, &refused]);
}

#[test]
fn a_drawing_is_corrected_and_moves_as_the_command_line_moves_it() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let server = serve(data.path(), &[]);
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("drawing.zip"), samples::drawing()).expect("written");
    std::fs::write(at("walk.glb"), samples::walk_clip()).expect("written");
    let mut archive = zip::ZipArchive::new(std::io::Cursor::new(samples::drawing())).expect("an archive");
    let mut texture = Vec::new();
    archive.by_name("texture.png").expect("its picture").read_to_end(&mut texture).expect("readable");
    std::fs::write(at("child.png"), texture).expect("written");
    if studio_script("drawings.mjs", &[&server.url, &folder.path().to_string_lossy()]).is_none() {
        return;
    }
    for ending in ["gif", "json"] {
        let status = Command::new(env!("CARGO_BIN_EXE_retargetd"))
            .args(["draw", "--drawing", "drawing.zip", "--source", "walk.glb", "--config", "config.json", "--output"])
            .arg(format!("command.{ending}"))
            .current_dir(folder.path())
            .status();
        assert!(status.expect("it runs").success(), "the exported config and drawing are understood");
        let (page, command) =
            (std::fs::read(at(&format!("page.{ending}"))), std::fs::read(at(&format!("command.{ending}"))));
        assert!(page.expect("downloaded") == command.expect("written"), "{ending}: byte for byte the same");
    }
}

/// Made anew with `node tests/tools/studio/goldens.mjs URL FOLDER keep`, where URL is a service that runs.
#[test]
fn eight_states_look_as_they_did() {
    let data = tempfile::tempdir().expect("a temporary folder");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("studio_goldens");
    std::fs::create_dir_all(&folder).expect("a folder for what differs");
    let server = serve(data.path(), &[]);
    let told = studio_script("goldens.mjs", &[&server.url, &folder.to_string_lossy()]);
    assert!(told.is_none_or(|told| told.len() == 8), "eight states");
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
    // One of each format that `GET /v1/formats` says is read; a drawing has a page of its own.
    let files = [
        "bvh/fair1/dab_zup.bvh",
        "cc0-stylised/kenney_medium_maya.fbx",
        "khronos/CesiumMan.glb",
        "cc0-stylised/quaternius_adventurer.gltf",
        "vrm0/catbot.vrm",
        "vrm1/makehuman_body_vrm1.vrm",
        "vrma/idle_loop.vrma",
        "smpl/aistpp_gBR_d04_smpl24_yup.npz",
        "smpl/humanml3d_012314_joints22.npy",
        "hostile/archives/fox-model-GLTF-BIN.zip",
    ];
    let Some(files) = files.into_iter().map(corpus_file).collect::<Option<Vec<_>>>() else { return };
    let mut files: Vec<String> = files.iter().map(|file| file.to_string_lossy().into_owned()).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("walk.glb"), samples::walk_clip()).expect("written");
    std::fs::write(folder.path().join("mannequin.glb"), samples::mannequin()).expect("written");
    let status = Command::new(env!("CARGO_BIN_EXE_retargetd"))
        .args([
            "retarget",
            "--source",
            "walk.glb",
            "--target",
            "mannequin.glb",
            "--output",
            "poses.npz",
            "--output",
            "poses.json",
        ])
        .current_dir(folder.path())
        .status();
    assert!(status.expect("it runs").success(), "arrays of poses");
    files.extend(["poses.npz", "poses.json"].map(|name| folder.path().join(name).to_string_lossy().into_owned()));
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
