//! The `demo` subcommand.

use std::process::ExitCode;

/// Arguments of `retargetd demo`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run(arguments: Arguments) -> ExitCode {
    let _ = arguments;
    todo!("wired when its parts land")
}
