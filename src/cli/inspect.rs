//! The `inspect` subcommand: what a file holds.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{engine, formats::Limits, model::Control};

use super::{
    exit::{Exit, FAILED, print},
    files::InputFile,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file to look at
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match inspect(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn inspect(arguments: &Arguments) -> Result<(), Exit> {
    let limits = Limits::default();
    let file = InputFile::read("file", &arguments.file, &limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let inspection = engine::inspect(file.as_named(), &limits, &control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("file {}", file.path.display())))?;
    let text = if arguments.json {
        serde_json::to_string_pretty(&inspection)
            .map_err(|error| Exit::new(FAILED, format!("the result cannot be written: {error}"), ""))?
    } else {
        inspection.to_string()
    };
    print(&format!("{}\n", text.trim_end()))
}
