//! Pictures that are of more than one file: comparisons and drawn characters.

use std::path::{Path, PathBuf};

use pyo3::{exceptions::PyValueError, prelude::*, pybacked::PyBackedBytes, types::PyBytes};
use retargetd::engine::{self, Failure, FailureCode, Limits, Manner, NamedBytes, PictureFormat, PreviewOptions};

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

/// A drawn character that moves: a scene of *Animated Drawings*, or a folder with a drawing and a motion. `ending` is that of a moving
/// picture, or `npz` for poses as arrays. Gives the bytes and what was chosen, as pairs of code and text.
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
    let format = match ending {
        "npz" => None,
        ending => Some(
            PictureFormat::of_ending(ending, true)
                .filter(|format| format.moves())
                .ok_or_else(|| PyValueError::new_err("drawings are written as npz, gif, webp, apng or mp4"))?,
        ),
    };
    let beside = scene.clone().unwrap_or_else(|| PathBuf::from("."));
    let (bytes, notes) = work(py, |control| {
        let limits = Limits::default();
        let mut read = |file: &str| read_named(file, &beside, &limits);
        let scenery = match (&scene, &drawing, &motion) {
            (None, Some(folder), Some((name, bytes))) => {
                let motion = (NamedBytes { name, bytes }, clip.as_deref());
                engine::stage_drawing(&folder.display().to_string(), &mut read, motion, &limits, control)?
            }
            (Some(path), None, _) => {
                let name = path.display().to_string();
                let bytes = read(&name)?;
                let manner = if original { Manner::Original } else { Manner::Steady };
                engine::read_scenery(NamedBytes { name: &name, bytes: &bytes }, &mut read, manner, control)?
            }
            _ => {
                let detail = "give a scene, or a drawing and a motion";
                return Err(Failure::new(FailureCode::InvalidValue, detail).in_part("config"));
            }
        };
        let bytes = match format {
            None => engine::draw_poses(&scenery, None, control)?,
            Some(format) => engine::draw_picture(&scenery, &mut read, format, control)?.0,
        };
        let notes = scenery.notes.iter().map(|(code, text)| ((*code).to_owned(), text.clone())).collect();
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
