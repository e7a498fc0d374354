//! The `joint-table` subcommand: a table of joint pairs to start from, for a spreadsheet.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{
    engine::{self, JointTable},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{Exit, INPUT_REFUSED, print, say, to_json},
    files::{StagedFiles, check_place},
    inputs::{InputFiles, InputPaths},
    taught::{PresetChoice, RigPaths},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd joint-table`.
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
    /// Where the table goes: as a config where the ending is .json, else as CSV. Without it, CSV on standard output
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match joint_table(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn joint_table(arguments: &Arguments) -> Result<(), Exit> {
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
    let table = JointTable::of(&proposal);
    if table.is_empty() {
        let hint = "name joints or roles in a config; 'retargetd suggest' says why nothing belongs together";
        return Err(Exit::new(INPUT_REFUSED, "no joint of the target follows one of the source", hint));
    }
    let Some(path) = &arguments.output else { return print(&table.to_csv()) };
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let text = if ending.as_deref() == Some("json") { to_json(&table.to_spec())? } else { table.to_csv() };
    let mut staged = StagedFiles::default();
    staged.add(path, text.as_bytes())?;
    staged.commit()?;
    say(format_args!("wrote {}: {} rows; use it with --config", path.display(), table.len()));
    Ok(())
}
