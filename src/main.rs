//! The `retargetd` binary: see `retargetd --help`, and the library's documentation for how it is built.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    retargetd::cli::run()
}
