//! The `edit` subcommand: one clip of one file, edited, back onto the file's own skeleton.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{
    engine::{self, EditInputs},
    formats::Limits,
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{Exit, say},
    files::InputFile,
    outputs::{WantedFormats, check_places, check_strict, tell_warnings, write_results},
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd edit`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file with the animation
    #[arg(long, value_name = "FILE")]
    input: PathBuf,
    /// The rig in its rest pose, where the file does not hold it
    #[arg(long, value_name = "FILE")]
    rest: Option<PathBuf>,
    /// The spec whose "edit" says what is to be done (JSON or YAML)
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Where the result goes; the ending picks the format. May be given several times
    #[arg(long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Where the report goes, as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Show a progress bar even on a dumb terminal; other terminals show it anyway, pipes never
    #[arg(long)]
    progress: bool,
    /// Treat every warning as an error
    #[arg(long)]
    strict: bool,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match edit(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn edit(arguments: &Arguments) -> Result<(), Exit> {
    let formats = WantedFormats::of(&arguments.output)?;
    check_places(&arguments.output, arguments.report.as_ref())?;
    let limits = Limits::default();
    let input = InputFile::read("input", &arguments.input, &limits)?;
    let rest = arguments.rest.as_ref().map(|path| InputFile::read("rest", path, &limits)).transpose()?;
    let config = InputFile::read("config", &arguments.config, &limits)?;
    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.progress);
    let inputs = EditInputs {
        source: input.as_named(),
        source_rest: rest.as_ref().map(InputFile::as_named),
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
    tell_warnings(&outcome);
    check_strict(arguments.strict, &outcome)?;
    write_results(&outcome, &arguments.output, &formats, arguments.report.as_ref(), &control)?;
    let counts = &outcome.report.counts;
    let outputs: Vec<String> = arguments.output.iter().map(|path| path.display().to_string()).collect();
    let seconds = outcome.report.timings.total_seconds;
    say(format_args!("wrote {}: {} frames, {seconds:.2} s", outputs.join(", "), counts.frames));
    Ok(())
}
