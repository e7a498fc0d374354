//! Which program engine processes are of.

use std::{ffi::OsString, io, path::PathBuf, process::Command, sync::OnceLock};

/// How an engine process is started: a program, and what comes before `engine-process` on its command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Program {
    /// The program.
    pub path: PathBuf,
    /// What it needs to hear first. Empty for the program that this crate builds.
    pub first_arguments: Vec<OsString>,
}

/// What a host said.
static OF_HOST: OnceLock<Program> = OnceLock::new();

impl Program {
    /// The one that a host named, else the one that runs.
    ///
    /// # Errors
    /// When it cannot be found out where this program is.
    pub(super) fn own() -> io::Result<Self> {
        if let Some(program) = OF_HOST.get() {
            return Ok(program.clone());
        }
        // On Linux, the program that runs, also when another one has taken its place in the file system.
        let own = PathBuf::from("/proc/self/exe");
        let path = if own.exists() { own } else { std::env::current_exe()? };
        Ok(Self { path, first_arguments: Vec::new() })
    }

    pub(super) fn command(&self) -> Command {
        let mut command = Command::new(&self.path);
        command.args(&self.first_arguments);
        command
    }
}

/// Says which program engine processes are of, where this library is part of another one, such as a Python interpreter. The first word
/// counts.
pub fn engine_processes_are(program: Program) {
    let _ = OF_HOST.set(program);
}
