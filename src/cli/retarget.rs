//! The `retarget` subcommand.

use std::process::ExitCode;

/// Arguments of `retargetd retarget`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    let _ = arguments;
    todo!("wired when its parts land")
}
