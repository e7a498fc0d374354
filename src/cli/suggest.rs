//! The `suggest` subcommand: the config that a retarget of two files would find out, to be looked at, edited and used again.

use std::{path::PathBuf, sync::Arc};

use crate::{
    engine::{self, Proposal},
    model::Control,
};

use super::{
    check_config::print_proposal,
    exit::{Exit, say, to_json},
    files::{StagedFiles, check_place},
    inputs::InputPaths,
    limits::LimitArguments,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd suggest`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    /// Output file of the suggested config, as JSON
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    if let Some(path) = &arguments.output {
        check_place(path)?;
    }
    let proposal = propose(&arguments.inputs, &arguments.limits)?;
    if let Some(path) = &arguments.output {
        StagedFiles::write_one(path, to_json(&proposal.resolved_spec)?.as_bytes())?;
    }
    print_proposal(&proposal, "")?;
    if let Some(path) = &arguments.output {
        say(format_args!("wrote {}: use it with --config", path.display()));
    }
    Ok(())
}

/// What a retarget of the two files would do.
pub(super) fn propose(inputs: &InputPaths, limits: &LimitArguments) -> Result<Proposal, Exit> {
    let limits = limits.limits;
    let (files, knowledge) = inputs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    engine::propose(&files.inputs(&[]), &knowledge, &limits, &control).map_err(|failure| files.exit(&failure))
}
