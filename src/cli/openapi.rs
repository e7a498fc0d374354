//! The `openapi` subcommand: prints the document that `/openapi.json` serves.

use std::process::ExitCode;

use super::exit;
use crate::http;

/// Arguments of `retargetd openapi`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Print the page of problems instead.
    #[arg(long)]
    problems: bool,
}

#[allow(clippy::print_stdout, reason = "the document is the command's output")]
pub(super) fn run(arguments: &Arguments) -> ExitCode {
    if arguments.problems {
        print!("{}", http::problems_page());
        return ExitCode::SUCCESS;
    }
    match http::openapi_document().to_pretty_json() {
        Ok(document) => {
            println!("{document}");
            ExitCode::SUCCESS
        }
        Err(error) => exit::refuse(exit::FAILED, &error),
    }
}
