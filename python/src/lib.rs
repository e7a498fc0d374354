//! The Python module `retargetd._engine`: bytes and JSON in, bytes and JSON out. What users see of it is Python, in `retargetd/`.
//!
//! Nothing here knows a format, a rig or an op: a call becomes one question to the engine, in this process or in one of its own, with the
//! interpreter's lock let go.

mod answer;
mod command;
mod engines;
mod errors;
mod inputs;
mod knowledge;
mod pictures;
mod plan;
mod work;

use pyo3::prelude::*;

/// Of the engine alone; the interpreter and NumPy keep theirs.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// The engine, as functions of bytes and JSON.
#[pymodule]
mod _engine {
    #[pymodule_export]
    use super::answer::{Ran, ask};
    #[pymodule_export]
    use super::command::{engine_processes_are, run_command};
    #[pymodule_export]
    use super::inputs::read_file;
    #[pymodule_export]
    use super::knowledge::{
        built_in_presets, built_in_rigs, config_schema, formats, merge_config, rig_schema, samples,
    };
    #[pymodule_export]
    use super::pictures::{compare, draw};
    #[pymodule_export]
    use super::plan::Plan;
    #[pymodule_export]
    use super::version;
}

/// The version of the crate.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
