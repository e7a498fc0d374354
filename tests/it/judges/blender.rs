//! What Blender makes of files.

use serde_json::Value;

use crate::support::blender;

/// What the reader says of each file. Nothing, said on standard error, where there is no Blender.
pub(super) fn read(files: &[String]) -> Option<Vec<Value>> {
    let output = blender("read.py")?.args(files).output().expect("Python runs");
    super::answers(&output, files.len())
}
