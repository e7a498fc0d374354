//! The `suggest` subcommand: the config that a retarget of two files would find out, to be looked at, edited and used again.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{engine, formats::Limits, model::Control};

use super::{
    check_config::print_proposal,
    exit::{Exit, say, to_json},
    files::{StagedFiles, check_place},
    inputs::{InputFiles, InputPaths},
    taught::{PresetChoice, RigPaths},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd suggest`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    /// A config with what is known already; the rest is found out
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    preset: PresetChoice,
    #[command(flatten)]
    rigs: RigPaths,
    /// Where the suggested config goes, as JSON
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match suggest(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn suggest(arguments: &Arguments) -> Result<(), Exit> {
    if let Some(path) = &arguments.output {
        check_place(path)?;
    }
    let limits = Limits::default();
    let InputPaths { source, target, rests } = &arguments.inputs;
    let files = InputFiles::read((source, target), rests, (arguments.config.as_deref(), &arguments.preset), &limits)?;
    let knowledge = arguments.rigs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let proposal = engine::propose_with(&files.inputs(&[]), &knowledge, &limits, &control)
        .map_err(|failure| files.exit(&failure))?;
    if let Some(path) = &arguments.output {
        let mut staged = StagedFiles::default();
        staged.add(path, to_json(&proposal.resolved_spec)?.as_bytes())?;
        staged.commit()?;
    }
    print_proposal(&proposal, arguments.json, "")?;
    if let Some(path) = &arguments.output {
        say(format_args!("wrote {}: use it with --config", path.display()));
    }
    Ok(())
}
