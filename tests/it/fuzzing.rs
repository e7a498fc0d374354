//! Thousands of broken inputs for every reader and every config, the same in each run; and what the fuzzer found, one test each.
//!
//! `tests/fuzz/run` searches with the same targets, seeds and mutations for as long as it is let, guided by coverage. This is what of it
//! fits into a run of all tests: the seeds as they are, cut short at many lengths, and changed some hundred times each.

mod found;
#[path = "../fuzz/src/shared/mod.rs"]
mod shared;

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
};

use shared::{Random, Target, change_bytes, mutate, seeds};

/// At so many lengths each seed is cut.
const CUTS: usize = 40;
/// Changes that one input gets, at most.
const MAX_CHANGES: usize = 4;

/// Gives the seeds of a target to it, whole, cut and changed, as many changed inputs as that.
///
/// # Panics
/// With the number of an input that breaks it.
fn search(target: Target, changed: usize) {
    let seeds = seeds(target);
    assert!(!seeds.is_empty(), "there is something to begin with");
    let others: Vec<&[u8]> = seeds.iter().map(|(_, bytes)| bytes.as_slice()).collect();
    for (name, bytes) in &seeds {
        let step = (bytes.len() / CUTS).max(1);
        for length in (0..bytes.len()).step_by(step).chain([bytes.len()]) {
            give(target, &bytes[..length], &format!("{name}, cut at {length}"));
        }
    }
    for number in 0..changed {
        let mut random = Random::new(number as u64);
        let (name, bytes) = &seeds[number % seeds.len()];
        let mut input = bytes.clone();
        for _ in 0..=random.below(MAX_CHANGES) {
            let other = others[random.below(others.len())];
            input = mutate(&input, &mut random, &mut |part, random| change_bytes(part, other, random));
        }
        give(target, &input, &format!("{name}, changed by {number}"));
    }
}

fn give(target: Target, input: &[u8], what: &str) {
    let outcome = catch_unwind(AssertUnwindSafe(|| target.run(input)));
    let head = input[..input.len().min(2000)].escape_ascii();
    assert!(outcome.is_ok(), "{} breaks on {what}; {} bytes: {head}", target.name(), input.len());
}

#[test]
fn fbx() {
    search(Target::Fbx, 1500);
}

#[test]
fn glb() {
    search(Target::Glb, 1500);
}

#[test]
fn gltf() {
    search(Target::Gltf, 1500);
}

#[test]
fn vrma() {
    search(Target::Vrma, 800);
}

#[test]
fn archives() {
    search(Target::Zip, 800);
}

#[test]
fn poses() {
    search(Target::PosesNpz, 1000);
    search(Target::PosesJson, 1000);
}

#[test]
fn captures() {
    search(Target::BodyModel, 1000);
    search(Target::JointPositions, 1000);
}

#[test]
fn bvh() {
    search(Target::Bvh, 4000);
}

#[test]
fn inspections() {
    search(Target::Sniff, 150);
}

#[test]
fn images() {
    search(Target::Image, 800);
}

#[test]
fn annotations() {
    search(Target::Annotation, 60);
}

#[test]
fn specs() {
    search(Target::Spec, 300);
    search(Target::RigTemplate, 300);
}

#[test]
fn requests() {
    for target in [Target::Retarget, Target::Edit, Target::Pose, Target::Proposal] {
        search(target, 40);
    }
}

#[test]
fn drawings() {
    search(Target::Drawing, 60);
    search(Target::Draw, 40);
}

#[test]
fn retargets() {
    search(Target::Engine, 40);
}

/// The fuzzer is a crate of its own; what it asks for of the same crates is what the service asks for.
#[test]
fn the_fuzzer_is_built_from_the_same_crates() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = |path: &str| std::fs::read_to_string(root.join(path)).expect("a file of the project");
    let (service, fuzzer) = (text("Cargo.toml"), text("tests/fuzz/Cargo.toml"));
    let shared =
        fuzzer.lines().skip_while(|line| *line != "[dependencies]").skip(1).take_while(|line| !line.starts_with('#'));
    let shared: Vec<&str> = shared.collect();
    assert!(shared.len() > 10, "its dependencies: {shared:?}");
    for line in shared {
        assert!(service.lines().any(|theirs| theirs == line), "the service does not ask for {line}");
    }
    // A crate may be locked in two versions, one for each of those that use it.
    let versions = |lock: &str, name: &str| {
        let wanted = format!("name = \"{name}\"");
        let lines: Vec<&str> = lock.lines().collect();
        let found: Vec<String> =
            lines.windows(2).filter(|pair| pair[0] == wanted).map(|pair| pair[1].to_owned()).collect();
        assert!(!found.is_empty(), "{name} is locked");
        found
    };
    let (service, fuzzer) = (text("Cargo.lock"), text("tests/fuzz/Cargo.lock"));
    let readers = ["zip", "flate2", "miniz_oxide", "ufbx", "meshopt", "serde_json", "serde-saphyr", "base64"];
    let images = ["png", "image-webp", "zune-jpeg", "fdeflate"];
    for name in readers.into_iter().chain(images) {
        let (theirs, ours) = (versions(&service, name), versions(&fuzzer, name));
        let is_theirs = ours.iter().all(|version| theirs.contains(version));
        assert!(is_theirs, "what decodes untrusted bytes is the same: {name} {ours:?}, and in the service {theirs:?}");
    }
}
