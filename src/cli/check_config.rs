//! The `check-config` subcommand: whether a config can be used, and what it would do to two files.

use std::{path::PathBuf, sync::Arc};

use crate::{
    engine::{self, NamedBytes, Proposal},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, print, say, to_json},
    files::InputFile,
    inputs::{InputFiles, RestPaths},
    limits::LimitArguments,
    manner::speaks_json,
    user_knowledge::{PresetChoice, RigPaths},
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd check-config`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The config to check (JSON or YAML)
    #[arg(value_name = "FILE")]
    config: PathBuf,
    /// The file with the animation; together with --target, names in the config are checked against both
    #[arg(long, value_name = "FILE", requires = "target")]
    source: Option<PathBuf>,
    /// The file with the target character
    #[arg(long, value_name = "FILE", requires = "source")]
    target: Option<PathBuf>,
    #[command(flatten)]
    rests: RestPaths,
    #[command(flatten)]
    preset: PresetChoice,
    #[command(flatten)]
    rigs: RigPaths,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let limits = arguments.limits.limits;
    let Some((source, target)) = arguments.source.as_deref().zip(arguments.target.as_deref()) else {
        if arguments.rests.source_rest.is_some() || arguments.rests.target_rest.is_some() {
            let hint = "give --source and --target too, or leave the rest files out";
            return Err(Exit::new(BAD_USAGE, "a rest file says nothing without the files that it belongs to", hint));
        }
        return check_alone(arguments, &limits);
    };
    let config = (Some(arguments.config.as_path()), &arguments.preset);
    let knowledge = arguments.rigs.read(&limits)?;
    let files =
        InputFiles::read(|| InputFile::read("source", source, &limits), target, &arguments.rests, config, &limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let proposal =
        engine::propose(&files.inputs(&[]), &knowledge, &limits, &control).map_err(|failure| files.exit(&failure))?;
    print_proposal(&proposal, &format!("config {} fits\n\n", arguments.config.display()))
}

fn check_alone(arguments: &Arguments, limits: &Limits) -> Result<(), Exit> {
    let config = InputFile::read("config", &arguments.config, limits)?;
    let shown = arguments.config.display();
    let merged = arguments.preset.under(Some(&config), limits)?;
    let bytes = merged.as_ref().map_or(config.as_named().bytes, String::as_bytes);
    let understood = engine::check_config(NamedBytes { bytes, ..config.as_named() })
        .map_err(|failure| Exit::from_failure(&failure, &format!("config {shown}")))?;
    if engine::is_empty_config(config.as_named()) {
        let (detail, hint) = engine::EMPTY_CONFIG;
        say(format_args!("warning: empty_config: {detail} ({hint})"));
    }
    if speaks_json() {
        return print(&to_json(&understood)?);
    }
    print(&format!(
        "config {shown} can be read; give --source and --target to check its names and to see what drives what\n"
    ))
}

/// On standard output, as text or as one JSON object.
pub(super) fn print_proposal(proposal: &Proposal, heading: &str) -> Result<(), Exit> {
    if speaks_json() { print(&to_json(proposal)?) } else { print(&format!("{heading}{proposal}")) }
}
