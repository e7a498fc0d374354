//! Exit codes, and how a failure is told on standard error.

use std::process::ExitCode;

use crate::engine::{Failure, FailureCode};

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
