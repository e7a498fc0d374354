//! Files as they come from Python: a name and bytes.

use std::{
    fs::File,
    io::Read,
    path::{Component, Path, PathBuf},
};

use pyo3::{prelude::*, pybacked::PyBackedBytes, types::PyBytes};
use retargetd::{
    engine::{Control, Failure, FailureCode, Limits, NamedBytes},
    formats::{self, FormatError},
};

use crate::errors::raised;

/// A name, and bytes that stay where Python has them.
pub(crate) type Given = Option<(String, PyBackedBytes)>;

/// Source, target, their rest poses and the config.
pub(crate) type Files = (Given, Given, Given, Given, Given);

/// The same, as the engine takes them.
pub(crate) fn named(file: &Given) -> Option<NamedBytes<'_>> {
    file.as_ref().map(|(name, bytes)| NamedBytes { name, bytes })
}

/// Reads a file, as the command line does: at most as much as the engine takes, and a glTF with what lies beside it.
#[pyfunction]
pub(crate) fn read_file<'py>(py: Python<'py>, path: PathBuf, part: &str) -> PyResult<Bound<'py, PyBytes>> {
    let limits = Limits::default();
    let bytes = py.detach(|| -> Result<Result<Vec<u8>, Failure>, std::io::Error> {
        let bytes = read_limited(File::open(&path)?, &limits)?;
        if bytes.len() as u64 > limits.file_bytes {
            return Ok(Err(too_large(&limits)));
        }
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if formats::may_point_to_others(&bytes, &name) {
            return Ok(with_neighbors(&bytes, &path, &limits).map_err(Failure::from));
        }
        Ok(Ok(bytes))
    })?;
    // The part is one of the engine's own words.
    let part = PARTS.into_iter().find(|known| *known == part).unwrap_or_default();
    let bytes = bytes.map_err(|failure| raised(py, &failure.in_part(part)))?;
    Ok(PyBytes::new(py, &bytes))
}

const PARTS: [&str; 5] = ["source", "target", "source_rest", "target_rest", "config"];

fn read_limited(file: File, limits: &Limits) -> std::io::Result<Vec<u8>> {
    let mut bytes =
        Vec::with_capacity(file.metadata().map_or(0, |metadata| metadata.len().min(limits.file_bytes)) as usize + 1);
    file.take(limits.file_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn too_large(limits: &Limits) -> Failure {
    let detail = format!("the file is larger than the {} bytes that are read", limits.file_bytes);
    Failure::new(FailureCode::AssetLimitExceeded, detail)
        .with_hint("send only the skeleton and its animation, or split the file")
}

/// Only what lies beside the file or below its folder is opened.
fn with_neighbors(document: &[u8], path: &Path, limits: &Limits) -> Result<Vec<u8>, FormatError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    formats::embed_with(document, limits, &Control::new(), |name| {
        let below = Path::new(name);
        if !below.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir)) {
            return Ok(None);
        }
        let Ok(file) = File::open(folder.join(below)) else { return Ok(None) };
        let content = read_limited(file, limits)
            .map_err(|error| FormatError::malformed("file", name, format!("it cannot be read: {error}")))?;
        if content.len() as u64 > limits.file_bytes {
            let detail = format!("the file is larger than the {} bytes that are read", limits.file_bytes);
            return Err(FormatError::malformed("file", name, detail));
        }
        Ok(Some(content))
    })
}
