//! The `openapi` subcommand: prints the document that `/openapi.json` serves.

use std::process::ExitCode;

use super::manner::speaks_json;
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
    if arguments.problems && speaks_json() {
        let codes = http::Code::ALL.iter().map(|code| {
            serde_json::json!({"code": code.name(), "status": code.status().as_u16(),
            "retryable": code.is_retryable(), "title": code.title(), "help": code.help()})
        });
        println!("{:#}", serde_json::json!({"problems": codes.collect::<Vec<_>>()}));
        return ExitCode::SUCCESS;
    }
    if arguments.problems {
        print!("{}", http::problems_page());
        return ExitCode::SUCCESS;
    }
    println!("{:#}", http::openapi_document());
    ExitCode::SUCCESS
}
