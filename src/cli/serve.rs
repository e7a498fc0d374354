//! The `serve` subcommand.

use std::process::ExitCode;

/// Arguments of `retargetd serve`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run(arguments: Arguments) -> ExitCode {
    let _ = arguments;
    todo!("wired when its parts land")
}
