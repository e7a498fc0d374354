//! The `completions` and `man` subcommands: what shells and `man` know of the command line, made from its definition.

use std::{io::Write, path::PathBuf};

use clap::Command;
use clap_complete::{Shell, generate};
use serde_json::json;

use super::{
    exit::{Exit, FAILED, print, report, say},
    manner::speaks_json,
};

/// Arguments of `retargetd completions`.
#[derive(Debug, clap::Args)]
pub(super) struct CompletionArguments {
    /// The shell
    #[arg(value_name = "SHELL", value_enum)]
    shell: Shell,
}

/// Arguments of `retargetd man`.
#[derive(Debug, clap::Args)]
pub(super) struct ManArguments {
    /// Write the pages of all subcommands into this folder, which is made where it is not there; without it, the page of the command itself
    /// goes to standard output
    #[arg(long, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(super) fn complete(arguments: &CompletionArguments, mut command: Command) -> Result<(), Exit> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut command, "retargetd", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    if speaks_json() {
        report(|| json!({"shell": arguments.shell.to_string(), "script": script}))
    } else {
        print(&script)
    }
}

pub(super) fn man(arguments: &ManArguments, command: Command) -> Result<(), Exit> {
    let failed = |error: std::io::Error| Exit::new(FAILED, format!("the pages cannot be written: {error}"), "");
    let Some(folder) = &arguments.output else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page).and_then(|()| page.flush()).map_err(failed)?;
        let page = String::from_utf8_lossy(&page).into_owned();
        return if speaks_json() { report(|| json!({"page": page})) } else { print(&page) };
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(command.disable_help_subcommand(true), folder).map_err(failed)?;
    say(format_args!("wrote the pages into {}", folder.display()));
    report(|| json!({"folder": folder}))
}
