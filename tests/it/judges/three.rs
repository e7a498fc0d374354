//! What three.js and three-vrm make of files.

use std::process::Command;

use serde_json::Value;

use crate::support::three_script;

/// What the reader says of each file. Nothing, said on standard error, when `RETARGETD_SKIP_NODE=1`.
pub(super) fn read(files: &[String]) -> Option<Vec<Value>> {
    let output = Command::new("node").arg(three_script("read.mjs")?).args(files).output().expect("node runs");
    super::answers(&output, files.len())
}
