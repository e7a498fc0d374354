//! What Blender makes of files.

use std::{path::Path, process::Command};

use serde_json::Value;

use crate::support::skip;

/// What the reader says of each file. Nothing, said on standard error, where no Python with the module `bpy` is named in
/// `RETARGETD_BLENDER_PYTHON`.
#[expect(clippy::disallowed_methods, reason = "tests have no settings")]
pub(super) fn read(files: &[String]) -> Option<Vec<Value>> {
    let Some(python) = std::env::var_os("RETARGETD_BLENDER_PYTHON") else {
        skip("Blender, because RETARGETD_BLENDER_PYTHON names no Python with the module bpy");
        return None;
    };
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/tools/blender_reader/read.py");
    let output = Command::new(python).arg(script).args(files).output().expect("Python runs");
    super::answers(&output, files.len())
}
