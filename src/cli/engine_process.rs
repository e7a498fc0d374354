//! The `engine-process` subcommand: what `serve` and `worker` start to run the engine in. Not for people.

use std::process::ExitCode;

use super::exit;
use crate::jobs::{Bounds, serve_engine_process};

/// Arguments of `retargetd engine-process`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Memory that it may use beside its own
    #[arg(long, value_name = "BYTES")]
    memory_bytes: u64,
    /// How long one request may take
    #[arg(long, value_name = "SECONDS")]
    seconds: u64,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    let bounds = Bounds { memory_bytes: arguments.memory_bytes, seconds: arguments.seconds };
    match serve_engine_process(&bounds) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::refuse(exit::FAILED, &error),
    }
}
