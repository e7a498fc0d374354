//! What three.js and three-vrm make of files.

use std::{path::Path, process::Command};

use serde_json::Value;

use crate::support::skip;

/// What the reader says of each file. Nothing, said on standard error, when `RETARGETD_SKIP_NODE=1`.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(super) fn read(files: &[String]) -> Option<Vec<Value>> {
    if std::env::var_os("RETARGETD_SKIP_NODE").is_some_and(|value| value == "1") {
        skip("three.js, because RETARGETD_SKIP_NODE is 1");
        return None;
    }
    let tool = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/three_reader");
    assert!(
        tool.join("node_modules/three").exists(),
        "three.js is not installed: run 'npm ci --prefix tests/tools/three_reader', or set RETARGETD_SKIP_NODE=1"
    );
    let output = Command::new("node").arg(tool.join("read.mjs")).args(files).output().expect("node runs");
    super::answers(&output, files.len())
}
