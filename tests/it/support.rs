//! What several test files need.

use std::{io::Write, path::PathBuf};

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
