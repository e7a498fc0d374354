//! The `edit` subcommand: one clip of one file, edited, back onto the file's own skeleton.

use std::{path::PathBuf, sync::Arc};

use crate::{
    engine::{self, EditInputs},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::Exit,
    files::InputFile,
    limits::LimitArguments,
    outputs::OutputArguments,
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd edit`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file with the animation
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    /// The rig in its rest pose, if the file does not contain it
    #[arg(long, value_name = "FILE")]
    rest: Option<PathBuf>,
    /// The config whose "edit" lists the edits (JSON or YAML)
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    #[command(flatten)]
    outputs: OutputArguments,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let paths = [Some(&arguments.input), arguments.rest.as_ref(), Some(&arguments.config)];
    let formats = arguments.outputs.check(paths.into_iter().flatten().map(PathBuf::as_path))?;
    let limits = arguments.limits.limits;
    let input = InputFile::read("input", &arguments.input, &limits)?;
    let rest = arguments.rest.as_ref().map(|path| InputFile::read("rest", path, &limits)).transpose()?;
    let config = InputFile::read("config", &arguments.config, &limits)?;
    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.outputs.destinations.progress);
    let inputs = EditInputs {
        source: input.as_named(),
        source_rest: rest.as_ref().map(InputFile::as_named),
        unread_target: false,
        config: Some(config.as_named()),
        formats: &formats.distinct,
    };
    let result = engine::edit(&inputs, &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| {
        let subject = match failure.part {
            "source" => format!("input {}", input.path.display()),
            "source_rest" => rest.as_ref().map_or_else(String::new, |rest| format!("rest {}", rest.path.display())),
            "config" => format!("config {}", config.path.display()),
            part => part.to_owned(),
        };
        Exit::from_failure(&failure, &subject)
    })?;
    arguments.outputs.finish(&outcome, &formats, &control)?;
    let (frames, seconds) = (outcome.report.counts.frames, outcome.report.timings.total_seconds);
    arguments.outputs.judge(&outcome, &format!("{frames} frames, {seconds:.2} s"))
}
