//! What assimp makes of files.

use serde_json::Value;

use crate::support::python_script;

/// What the reader says of each file. Nothing, said on standard error, where there is no assimp.
pub(super) fn read(files: &[String]) -> Option<Vec<Value>> {
    let (variable, script) = ("RETARGETD_ASSIMP_PYTHON", "assimp_reader/read.py");
    let output = python_script(variable, "pyassimp", script)?.args(files).output().expect("Python runs");
    super::answers(&output, files.len())
}
