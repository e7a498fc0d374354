//! The `engine-process` subcommand: what `serve` and `worker` start to run the engine in. Not for people.

use std::process::ExitCode;

use super::exit;
use crate::jobs::{Bounds, serve_engine_process};

/// Arguments of `retargetd engine-process`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Memory limit
    #[arg(long, value_name = "BYTES")]
    memory_bytes: u64,
    /// Bytes of all outputs of one answer
    #[arg(long, value_name = "BYTES")]
    output_bytes: u64,
    /// Timeout of one request
    #[arg(long, value_name = "SECONDS")]
    seconds: u64,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    // Lists of processes show this, and not the name of the link that it was started by.
    if cfg!(target_os = "linux") {
        let _ = std::fs::write("/proc/self/comm", "retarget-engine");
    }
    let Arguments { memory_bytes, output_bytes, seconds } = *arguments;
    let bounds = Bounds { memory_bytes, output_bytes, seconds };
    match serve_engine_process(&bounds) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::refuse(exit::FAILED, &error),
    }
}
