//! The `explain` subcommand: why a joint of the result is turned as it is at one frame.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{
    engine::{self, Question},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{Exit, print, to_json},
    inputs::{InputFiles, InputPaths},
    taught::{PresetChoice, RigPaths},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd explain`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    /// The retarget spec (JSON or YAML); without it, everything is found out
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    preset: PresetChoice,
    #[command(flatten)]
    rigs: RigPaths,
    /// The frame, from 0
    #[arg(long, value_name = "N")]
    frame: usize,
    /// The joint of the target, by name or #<node index>
    #[arg(long, value_name = "NAME")]
    joint: String,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match explain(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn explain(arguments: &Arguments) -> Result<(), Exit> {
    let limits = Limits::default();
    let InputPaths { source, target, rests } = &arguments.inputs;
    let files = InputFiles::read((source, target), rests, (arguments.config.as_deref(), &arguments.preset), &limits)?;
    let knowledge = arguments.rigs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let question = Question { frame: arguments.frame, joint: &arguments.joint };
    let explanation = engine::explain_with(&files.inputs(&[]), &question, &knowledge, &limits, &control)
        .map_err(|failure| files.exit(&failure))?;
    if arguments.json {
        return print(&format!("{}\n", to_json(&explanation)?.trim_end()));
    }
    print(&explanation.to_string())
}
