//! Fuzzes one target of the pure half: `tests/fuzz/run` says how.
//!
//! Without libFuzzer's own words it does two more things: `fuzz targets` names the targets, and `fuzz seeds FOLDER` writes what the target
//! begins with.
#![no_main]

mod shared;

use std::{env, fs, path::Path, process, sync::OnceLock};

use libfuzzer_sys::{fuzz_mutator, fuzz_target, fuzzer_mutate};
use shared::{Random, Target, change_bytes, mutate, seeds};

/// What is fuzzed in this process; set before the first input.
static TARGET: OnceLock<Target> = OnceLock::new();

fuzz_target!(init: prepare(), |bytes: &[u8]| {
    if let Some(target) = TARGET.get() {
        target.run(bytes);
    }
});

fuzz_mutator!(|data: &mut [u8], size: usize, max_size: usize, seed: u32| {
    let mut random = Random::new(seed.into());
    let changed = mutate(&data[..size], &mut random, &mut |part, random| {
        if random.one_in(3) { change_bytes(part, part, random) } else { compared_bytes(part) }
    });
    let length = changed.len().min(max_size);
    data[..length].copy_from_slice(&changed[..length]);
    length
});

/// A change of libFuzzer's own, which knows what bytes the code has lately been compared with.
fn compared_bytes(part: &[u8]) -> Vec<u8> {
    let most = (part.len() * 2).max(64);
    let mut changed = part.to_vec();
    changed.resize(most, 0);
    let length = fuzzer_mutate(&mut changed, part.len(), most);
    changed.truncate(length);
    changed
}

/// Obeys the two commands of our own, and finds out the target.
fn prepare() {
    let words: Vec<String> = env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    if words == ["targets"] {
        Target::ALL.iter().for_each(|target| println!("{}", target.name()));
        process::exit(0);
    }
    let name = env::var("RETARGETD_FUZZ_TARGET").unwrap_or_default();
    let Some(target) = Target::ALL.into_iter().find(|target| target.name() == name) else {
        eprintln!("'{name}' is no target; tests/fuzz/run without a word lists them");
        process::exit(2);
    };
    if let ["seeds", folder] = words[..] {
        for (name, bytes) in seeds(target) {
            let file = Path::new(folder).join(format!("seed_{name}"));
            if let Err(error) = fs::write(&file, bytes) {
                eprintln!("{}: {error}", file.display());
                process::exit(1);
            }
        }
        process::exit(0);
    }
    TARGET.get_or_init(|| target);
}
