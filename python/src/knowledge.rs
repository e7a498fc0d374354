//! What the engine knows without any file: rigs, presets, formats, schemas, samples.

use pyo3::{prelude::*, types::PyBytes};
use retargetd::{
    engine::{self, Format, NamedBytes},
    retarget::spec_schema,
    samples as made,
};
use serde_json::{Value, json};

use crate::errors::raised;

fn by_name(documents: Vec<(String, Value)>) -> String {
    Value::Object(documents.into_iter().collect()).to_string()
}

/// The built-in rigs as one JSON object by name.
#[pyfunction]
pub(crate) fn built_in_rigs() -> String {
    by_name(engine::built_in_rigs())
}

/// The built-in presets as one JSON object by name.
#[pyfunction]
pub(crate) fn built_in_presets() -> String {
    by_name(engine::built_in_presets())
}

/// The JSON Schema of a config.
#[pyfunction]
pub(crate) fn config_schema() -> String {
    spec_schema().to_string()
}

/// The JSON Schema of a rig template.
#[pyfunction]
pub(crate) fn rig_schema() -> String {
    engine::template_schema().to_string()
}

/// A preset with a config laid over it.
#[pyfunction]
pub(crate) fn merge_config(py: Python<'_>, preset: &str, config: Option<&[u8]>) -> PyResult<String> {
    let preset: Value = serde_json::from_str(preset).unwrap_or_default();
    let config = config.map(|bytes| NamedBytes { name: "config.json", bytes });
    engine::merge_config(&preset, config).map_err(|failure| raised(py, &failure))
}

/// Every format as JSON: name, endings, media type, whether it is read and written, what it is.
#[pyfunction]
pub(crate) fn formats() -> String {
    let view = |format: &Format| {
        let info = format.info();
        json!({
            "name": info.name, "endings": info.endings, "media_type": info.media_type, "reads": info.reads,
            "writes": info.writes, "description": info.description, "is_picture": info.is_picture,
        })
    };
    Value::Array(Format::ALL.iter().map(view).collect()).to_string()
}

/// The sample clip and the sample character, as GLB.
#[pyfunction]
pub(crate) fn samples(py: Python<'_>) -> (Bound<'_, PyBytes>, Bound<'_, PyBytes>) {
    (PyBytes::new(py, &made::walk_clip()), PyBytes::new(py, &made::mannequin()))
}
