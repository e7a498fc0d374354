//! The `retargetd` command, and what its engine processes are.

use std::{ffi::OsString, path::PathBuf};

use pyo3::prelude::*;
use retargetd::{cli, jobs};

/// Runs a command line, the program's name first; gives the exit code.
#[pyfunction]
pub(crate) fn run_command(py: Python<'_>, command_line: Vec<OsString>) -> u8 {
    py.detach(|| cli::run_with(command_line))
}

/// Says how engine processes are started: by an interpreter with this module in it.
#[pyfunction]
pub(crate) fn engine_processes_are(path: PathBuf, first_arguments: Vec<OsString>) {
    jobs::engine_processes_are(jobs::Program { path, first_arguments });
}
