//! The `joint-table` subcommand: a table of joint pairs to start from, for a spreadsheet.

use std::path::PathBuf;

use serde_json::json;

use crate::report::JointTable;

use super::{
    exit::{Exit, INPUT_REFUSED, print, report, say, to_json},
    files::{StagedFiles, check_place},
    inputs::InputPaths,
    limits::LimitArguments,
    manner::speaks_json,
    suggest::propose,
};

/// Arguments of `retargetd joint-table`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    /// Output file: a config if the extension is .json, else CSV. Without it, CSV on standard output
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
    let table = JointTable::of(&proposal);
    if table.is_empty() {
        let hint = "name joints or roles in a config; 'retargetd suggest' says why nothing belongs together";
        return Err(Exit::new(INPUT_REFUSED, "no joint of the target follows one of the source", hint));
    }
    let Some(path) = &arguments.output else {
        return if speaks_json() { print(&to_json(&table.to_spec())?) } else { print(&table.to_csv()) };
    };
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    let text = if ending.as_deref() == Some("json") { to_json(&table.to_spec())? } else { table.to_csv() };
    StagedFiles::write_one(path, text.as_bytes())?;
    say(format_args!("wrote {}: {} rows; use it with --config", path.display(), table.len()));
    report(|| json!({"output": path, "rows": table.len()}))
}
