//! Exit codes, and how a failure is told on standard error.

use std::process::ExitCode;

use crate::engine::{Failure, FailureCode};

/// The command line or the environment cannot be used.
pub(super) const BAD_USAGE: u8 = 2;
/// An input was refused.
pub(super) const INPUT_REFUSED: u8 = 3;
/// The work failed for a reason that is not the input's.
pub(super) const FAILED: u8 = 4;

/// The exit code of a failure: 3 when the input is to blame, 4 otherwise.
pub(super) fn exit_code(failure: &Failure) -> ExitCode {
    match failure.code {
        FailureCode::Canceled | FailureCode::Internal => ExitCode::from(FAILED),
        _ => ExitCode::from(INPUT_REFUSED),
    }
}

/// Tells the reason on standard error and gives the exit code.
#[allow(clippy::print_stderr, reason = "this is how a command says why it failed")]
pub(super) fn refuse(code: u8, reason: &dyn std::fmt::Display) -> ExitCode {
    eprintln!("error: {reason}");
    ExitCode::from(code)
}
