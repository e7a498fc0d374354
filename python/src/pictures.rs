//! Pictures that are of more than one file: comparisons and drawn characters.

use std::path::{Path, PathBuf};

use pyo3::{exceptions::PyValueError, prelude::*, pybacked::PyBackedBytes, types::PyBytes};
use retargetd::engine::{
    self, DrawRequest, DrawSpec, Failure, FailureCode, Format, Knowledge, Limits, NamedBytes, PreviewOptions,
};

use crate::work::work;

/// Two files at one scale and the same time; the options are JSON.
#[pyfunction]
pub(crate) fn compare<'py>(
    py: Python<'py>,
    first: (String, PyBackedBytes),
    second: (String, PyBackedBytes),
    options: &str,
) -> PyResult<Bound<'py, PyBytes>> {
    let options: PreviewOptions =
        serde_json::from_str(options).map_err(|error| PyValueError::new_err(error.to_string()))?;
    let file = |(name, bytes): &'_ (String, PyBackedBytes)| (name.clone(), bytes.clone_ref(py));
    let ((first_name, first), (second_name, second)) = (file(&first), file(&second));
    let picture = work(py, |control| {
        let first = NamedBytes { name: &first_name, bytes: &first };
        let second = NamedBytes { name: &second_name, bytes: &second };
        engine::compare(first, second, &options, &Limits::default(), control)
    })?;
    Ok(PyBytes::new(py, &picture.bytes))
}

/// A drawn character that moves: a scene of *Animated Drawings*, or a folder with a drawing and a motion. `ending` picks the format, as of
/// `retargetd draw`. Gives the bytes and what was chosen, as pairs of code and text.
#[pyfunction]
#[pyo3(signature = (scene, drawing, motion, clip, ending, original))]
pub(crate) fn draw<'py>(
    py: Python<'py>,
    scene: Option<PathBuf>,
    drawing: Option<PathBuf>,
    motion: Option<(String, PyBackedBytes)>,
    clip: Option<String>,
    ending: &str,
    original: bool,
) -> PyResult<(Bound<'py, PyBytes>, Vec<(String, String)>)> {
    let format =
        Format::from_file_name(&format!("drawing.{ending}")).and_then(Format::of_drawing).ok_or_else(|| {
            PyValueError::new_err("drawings are written as npz, json, gif, webp, png, apng, mp4, zip or glb")
        })?;
    let beside = scene.clone().unwrap_or_else(|| PathBuf::from("."));
    let (bytes, notes) = work(py, |control| {
        let limits = Limits::default();
        let mut read = |file: &str| read_named(file, &beside, &limits);
        let mut spec = DrawSpec::default();
        if original {
            spec = spec.with_compat();
        }
        if let Some(clip) = &clip {
            spec = spec.with_clip(clip);
        }
        let formats = [format];
        let name = scene.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
        let config = scene.as_ref().map(|_| read(&name)).transpose()?;
        let folder = drawing.as_ref().map(|folder| folder.display().to_string());
        let request = DrawRequest {
            scene: config.as_deref().map(|bytes| NamedBytes { name: &name, bytes }),
            folder: folder.as_deref(),
            source: motion.as_ref().map(|(name, bytes)| NamedBytes { name, bytes }),
            spec,
            formats: &formats,
            ..DrawRequest::default()
        };
        let outcome = engine::draw(&request, &mut read, &Knowledge::default(), &limits, control)?;
        let choices = outcome.report.drawing.map(|report| report.choices).unwrap_or_default();
        let choices = choices.into_iter().map(|text| ("drawing_choice".to_owned(), text));
        let warnings = outcome.report.warnings.into_iter().map(|warning| (warning.code.to_owned(), warning.detail));
        let notes: Vec<(String, String)> = choices.chain(warnings).collect();
        let bytes = outcome.outputs.into_iter().next().map(|output| output.bytes).unwrap_or_default();
        Ok((bytes, notes))
    })?;
    Ok((PyBytes::new(py, &bytes), notes))
}

/// A file that a config names: where it is said to be, beside the scene, or beside one of the folders that the scene is in.
fn read_named(file: &str, scene: &Path, limits: &Limits) -> Result<Vec<u8>, Failure> {
    let refused = |detail: String| {
        Failure::new(FailureCode::UnknownName, detail)
            .with_hint("work in the folder that the paths of the configs begin in")
    };
    let beside = scene.ancestors().skip(1).map(|folder| folder.join(file));
    let found = std::iter::once(PathBuf::from(file)).chain(beside).find(|path| path.is_file());
    let path = found.ok_or_else(|| refused(format!("there is no file {file}")))?;
    let bytes = std::fs::metadata(&path).map(|metadata| metadata.len());
    if bytes.is_ok_and(|bytes| bytes > limits.file_bytes) {
        let detail = format!("{file} is larger than the {} bytes that are read", limits.file_bytes);
        return Err(Failure::new(FailureCode::AssetLimitExceeded, detail));
    }
    std::fs::read(&path).map_err(|error| refused(format!("{file} cannot be read: {error}")))
}
