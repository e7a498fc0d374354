//! What several test files need.

use std::path::PathBuf;

/// A file of the corpus of real files, which lies beside the checkout on the developers' machines and in CI and is not
/// part of the project. Says so on standard error when it is not there, so that no skip is silent.
pub fn corpus_file(path: &str) -> Option<PathBuf> {
    let file = shared_folder().join("corpus").join(path);
    if file.exists() {
        return Some(file);
    }
    eprintln!("skipped: {} is not there", file.display());
    None
}

/// The folder of shared material beside the checkout; `RETARGETD_SHARED` names another place.
pub fn shared_folder() -> PathBuf {
    std::env::var_os("RETARGETD_SHARED")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from)
}
