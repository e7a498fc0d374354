//! What several test files need.

use std::{
    collections::BTreeMap,
    io::Write,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use glam::DVec3;
use retargetd::{
    formats::{self, Limits},
    model::Control,
};
use serde_json::Value;
use sha2::{Digest, Sha256};

/// A file of the corpus of real files, which lies beside the checkout on the developers' machines and in CI and is not
/// part of the project. Says so on standard error when it is not there, so that no skip is silent.
pub(crate) fn corpus_file(path: &str) -> Option<PathBuf> {
    let file = shared_folder().join("corpus").join(path);
    if file.exists() {
        return Some(file);
    }
    skip(&format!("{} is not there", file.display()));
    None
}

/// Says that this test leaves something out. `tests/run` counts the tests that did, in the file that it names.
#[expect(clippy::print_stderr, clippy::disallowed_methods, reason = "no skip is silent, and this is how it is told")]
pub(crate) fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
    let Some(list) = std::env::var_os("RETARGETD_SKIPPED") else { return };
    let test = std::thread::current().name().unwrap_or("main").to_owned();
    let test = std::env::var("NEXTEST_TEST_NAME").unwrap_or(test);
    // One write per line, so that tests that run side by side do not tear it.
    let line = format!("{test}\t{reason}\n");
    let written = std::fs::OpenOptions::new().append(true).create(true).open(list);
    written.and_then(|mut list| list.write_all(line.as_bytes())).expect("the list of skips can be written");
}

/// The folder of shared material beside the checkout; `RETARGETD_SHARED` names another place.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(crate) fn shared_folder() -> PathBuf {
    std::env::var_os("RETARGETD_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from)
}

/// Bytes as hexadecimal digits.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The SHA-256 of bytes, in hexadecimal.
pub(crate) fn sha256_of(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// All files below a folder, in order.
pub(crate) fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_owned()];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() { open.push(path) } else { found.push(path) }
        }
    }
    found.sort();
    found
}

/// A document whose buffers lie beside it, with them in it.
pub(crate) fn with_buffers(bytes: &[u8], path: &Path) -> Vec<u8> {
    let folder = path.parent().expect("a folder");
    let fetch = |uri: &str| Ok(std::fs::read(folder.join(uri)).ok());
    formats::embed_with(bytes, &Limits::default(), &Control::new(), fetch).expect("all of it is there")
}

/// The JSON of a glTF document, of whichever container.
pub(crate) fn gltf_json(bytes: &[u8]) -> Value {
    if !bytes.starts_with(b"glTF") {
        return serde_json::from_slice(bytes).expect("JSON");
    }
    let length = u32::from_le_bytes(bytes[12..16].try_into().expect("four bytes")) as usize;
    serde_json::from_slice(&bytes[20..20 + length]).expect("JSON")
}

/// Whether node may be used. It may not when `RETARGETD_SKIP_NODE=1`, which is said on standard error.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(crate) fn may_use_node(what_for: &str) -> bool {
    let is_skipped = std::env::var_os("RETARGETD_SKIP_NODE").is_some_and(|value| value == "1");
    if is_skipped {
        skip(&format!("{what_for}, because RETARGETD_SKIP_NODE is 1"));
    }
    !is_skipped
}

/// An axis as the parser of FBX calls it; nowhere where it is not known.
pub(crate) const fn fbx_axis(axis: ufbx::CoordinateAxis) -> DVec3 {
    match axis {
        ufbx::CoordinateAxis::PositiveX => DVec3::X,
        ufbx::CoordinateAxis::NegativeX => DVec3::NEG_X,
        ufbx::CoordinateAxis::PositiveY => DVec3::Y,
        ufbx::CoordinateAxis::NegativeY => DVec3::NEG_Y,
        ufbx::CoordinateAxis::PositiveZ => DVec3::Z,
        ufbx::CoordinateAxis::NegativeZ => DVec3::NEG_Z,
        _ => DVec3::ZERO,
    }
}

/// A script of `tests/tools/three_reader`, for node. Nothing, said on standard error, when `RETARGETD_SKIP_NODE=1`.
pub(crate) fn three_script(name: &str) -> Option<PathBuf> {
    if !may_use_node("three.js") {
        return None;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/three_reader");
    assert!(
        tool.join("node_modules/three").exists(),
        "three.js is not installed: run 'npm ci --prefix tests/tools/three_reader', or set RETARGETD_SKIP_NODE=1"
    );
    Some(tool.join(name))
}

/// A script of `tests/tools/browser`, for node. Nothing, said on standard error, when `RETARGETD_SKIP_NODE=1` or there is no Chromium.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(crate) fn browser_script(name: &str) -> Option<PathBuf> {
    if !may_use_node("Chromium") {
        return None;
    }
    let chromium = std::env::var_os("RETARGETD_CHROMIUM").unwrap_or_else(|| "/usr/bin/chromium".into());
    if !Path::new(&chromium).exists() {
        skip("there is no Chromium; RETARGETD_CHROMIUM says where it is");
        return None;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/browser");
    assert!(
        tool.join("node_modules/playwright-core").exists(),
        "playwright-core is not installed: run 'npm ci --prefix tests/tools/browser', or set RETARGETD_SKIP_NODE=1"
    );
    Some(tool.join(name))
}

/// A script of `tests/tools/blender_reader`. Nothing, said on standard error, where there is no Blender.
pub(crate) fn blender(script: &str) -> Option<Command> {
    python_script("RETARGETD_BLENDER_PYTHON", "bpy", &format!("blender_reader/{script}"))
}

/// A script of `tests/tools`, for the Python with that module which a variable names. Nothing, said on standard error, where it names
/// none.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(crate) fn python_script(variable: &str, module: &str, script: &str) -> Option<Command> {
    let Some(python) = std::env::var_os(variable) else {
        skip(&format!("{module}, because {variable} names no Python with that module"));
        return None;
    };
    let mut command = Command::new(python);
    command.arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools").join(script));
    Some(command)
}

/// One report per file from the Khronos validator. Nothing, said on standard error, when `RETARGETD_SKIP_NODE=1`.
pub(crate) fn validate_gltf<'a>(files: &[&'a Path]) -> Option<BTreeMap<&'a Path, Value>> {
    if !may_use_node("the Khronos validator") {
        return None;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/gltf_validator");
    assert!(
        tool.join("node_modules/gltf-validator").exists(),
        "the Khronos validator is not installed: run 'npm ci --prefix tests/tools/gltf_validator', or set RETARGETD_SKIP_NODE=1"
    );
    let output = Command::new("node").arg(tool.join("validate.mjs")).args(files).output().expect("node runs");
    assert!(output.status.success(), "the validator works: {}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).expect("text");
    let reports: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).expect("one JSON a line")).collect();
    assert_eq!(reports.len(), files.len(), "one report for each file");
    Some(files.iter().copied().zip(reports).collect())
}

/// A number that a developer may set to run a test for longer.
pub(crate) fn count_of(variable: &str, otherwise: usize) -> usize {
    Extent::of(variable, otherwise).amount
}

/// How much a test does, and whether it is held to figures: only where somebody asked for an amount.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Extent {
    pub(crate) amount: usize,
    pub(crate) is_measured: bool,
}

impl Extent {
    /// The usual amount, or what the variable says.
    #[expect(clippy::disallowed_methods, reason = "tests have no settings")]
    pub(crate) fn of(variable: &str, usual: usize) -> Self {
        let given = std::env::var(variable).ok().and_then(|text| text.parse().ok());
        Self { amount: given.unwrap_or(usual), is_measured: given.is_some() }
    }

    /// Asserts what only a measurement can say, and prints it.
    pub(crate) fn holds(self, is_true: bool, figure: &str) {
        self.all_hold(&[(is_true, figure.to_owned())]);
    }

    /// The same for several, which are all printed, whether or not they hold.
    #[expect(clippy::print_stdout, reason = "figures are what the long runs are for")]
    pub(crate) fn all_hold(self, figures: &[(bool, String)]) {
        if self.is_measured {
            figures.iter().for_each(|(_, figure)| println!("{figure}"));
            figures.iter().for_each(|(is_true, figure)| assert!(is_true, "{figure}"));
        }
    }
}

/// A Python that has that module: the one that `tests/run` made, else the system's.
pub(crate) fn python_with(module: &str) -> Option<PathBuf> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/test-python/bin/python3");
    [own, PathBuf::from("python3")].into_iter().find(|python| {
        let code = format!("import importlib.util, sys; sys.exit(importlib.util.find_spec('{module}') is None)");
        Command::new(python).args(["-c", &code]).stderr(Stdio::null()).status().is_ok_and(|status| status.success())
    })
}
