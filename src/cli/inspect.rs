//! The `inspect` subcommand: what a file holds.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{engine, formats::Limits, model::Control};

use super::{
    exit::{Exit, print, to_json},
    files::InputFile,
    user_knowledge::RigPaths,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file to inspect
    #[arg(value_name = "FILE")]
    file: PathBuf,
    #[command(flatten)]
    rigs: RigPaths,
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
    let knowledge = arguments.rigs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let inspection = engine::inspect_with(file.as_named(), &knowledge, &limits, &control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("file {}", file.path.display())))?;
    print(&if arguments.json { to_json(&inspection)? } else { format!("{}\n", inspection.to_string().trim_end()) })
}
