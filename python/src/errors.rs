//! What the engine refuses, as exceptions of `retargetd.errors`.

use pyo3::prelude::*;
use retargetd::engine::Failure;

/// The exception of a failure. `retargetd.errors.of_failure` knows which class a code belongs to.
pub(crate) fn raised(py: Python<'_>, failure: &Failure) -> PyErr {
    let errors = serde_json::to_string(&failure.errors).unwrap_or_else(|_| "[]".to_owned());
    let made = py.import("retargetd.errors").and_then(|module| {
        let parts = (failure.code.name(), &failure.detail, failure.part, &failure.place, &failure.hint, errors);
        module.getattr("of_failure")?.call1(parts)
    });
    match made {
        Ok(exception) => PyErr::from_value(exception),
        Err(error) => error,
    }
}
