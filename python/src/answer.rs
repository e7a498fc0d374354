//! Any question to the engine, and what it answers.

use pyo3::{
    IntoPyObjectExt as _,
    exceptions::PyValueError,
    prelude::*,
    types::{PyBytes, PyString, PyTuple},
};
use retargetd::{
    engine::{Format, Knowledge, Limits, TaskKind, task_of},
    jobs::{Answer, EngineRequest, Files as AskedFiles, Question},
};

use crate::{
    engines::engine,
    errors::raised,
    inputs::{Files, named},
    work::work,
};

/// What a task gave.
#[pyclass(frozen, module = "retargetd._engine")]
pub(crate) struct Ran {
    outputs: Vec<(String, String, Py<PyBytes>)>,
    report: String,
    resolved_spec: String,
    total_seconds: f64,
}

#[pymethods]
impl Ran {
    /// Format, name and bytes of each file that came out.
    #[getter]
    fn outputs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        let outputs = self.outputs.iter().map(|(format, name, bytes)| (format, name, bytes.clone_ref(py)));
        PyTuple::new(py, outputs.collect::<Vec<_>>())
    }

    /// The report as JSON.
    #[getter]
    fn report<'py>(&self, py: Python<'py>) -> Bound<'py, PyString> {
        PyString::new(py, &self.report)
    }

    /// The spec with everything found out, as JSON.
    #[getter]
    fn resolved_spec<'py>(&self, py: Python<'py>) -> Bound<'py, PyString> {
        PyString::new(py, &self.resolved_spec)
    }

    /// What the engine took.
    #[getter]
    const fn total_seconds(&self) -> f64 {
        self.total_seconds
    }
}

/// Asks. The question is JSON; the answer is a `Ran`, a picture as bytes, or a document as text.
#[pyfunction]
pub(crate) fn ask(
    py: Python<'_>,
    question: &str,
    files: Files,
    formats: Vec<String>,
    rigs: Vec<String>,
    isolate: bool,
) -> PyResult<Py<PyAny>> {
    let question: Question =
        serde_json::from_str(question).map_err(|error| PyValueError::new_err(format!("no question: {error}")))?;
    let formats = formats.iter().map(|name| format_of(name)).collect::<PyResult<Vec<_>>>()?;
    let knowledge = Knowledge::unread(rigs);
    let limits = Limits::default();
    let asked_files = AskedFiles {
        source: named(&files.0),
        target: named(&files.1),
        source_rest: named(&files.2),
        target_rest: named(&files.3),
        scene: None,
        config: named(&files.4),
        target_sha256: None,
    };
    // A config may ask for another task, as on the command line.
    let question = match (question, task_of(asked_files.config)) {
        (Question::Retarget, TaskKind::Edit) => Question::Edit,
        (Question::Retarget, TaskKind::Pose) => Question::Pose { to: None },
        (question, _) => question,
    };
    let asked =
        EngineRequest { question, files: asked_files, formats: &formats, knowledge: &knowledge, limits: &limits };
    let engine = engine(isolate).map_err(|failure| raised(py, &failure))?;
    match work(py, |control| engine.ask(&asked, control))? {
        Answer::Picture(bytes) | Answer::Archive(bytes) => PyBytes::new(py, &bytes).into_py_any(py),
        Answer::Document(document) => document.to_string().into_py_any(py),
        Answer::EngineResult(ran) => {
            let outputs = ran.outputs.into_iter().map(|made| {
                let bytes = PyBytes::new(py, &made.output.bytes).unbind();
                (made.output.format.info().name.to_owned(), made.output.name, bytes)
            });
            let outputs = outputs.collect();
            let total_seconds = ran.timings.total_seconds;
            Ran { outputs, report: ran.report, resolved_spec: ran.resolved_spec, total_seconds }.into_py_any(py)
        }
    }
}

/// A format by its name on the wire or by the ending of a file name.
pub(crate) fn format_of(name: &str) -> PyResult<Format> {
    let ending = format!("file.{}", name.trim_start_matches('.'));
    let format = Format::from_name(name).or_else(|| Format::from_file_name(&ending));
    match format {
        Some(format) if format.info().writes => Ok(format),
        Some(format) => Err(PyValueError::new_err(format.info().why_unwritten())),
        None => Err(PyValueError::new_err(format!("'{name}' is no format; retargetd.formats() lists them"))),
    }
}
