//! The `retarget` subcommand: one clip onto one character, without a server.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{
    engine::{self, Outcome},
    formats::Limits,
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{Exit, say},
    inputs::{InputFiles, InputPaths},
    outputs::{WantedFormats, check_places, check_strict, tell_warnings, write_results},
    taught::{PresetChoice, RigPaths},
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd retarget`.
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
    /// Where the result goes; the ending picks the format. May be given several times
    #[arg(long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Where the report goes: as a page to look at where the ending is .html, else as JSON
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
    match retarget(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn retarget(arguments: &Arguments) -> Result<(), Exit> {
    let formats = WantedFormats::of(&arguments.output)?;
    check_places(&arguments.output, arguments.report.as_ref())?;
    let limits = Limits::default();
    let InputPaths { source, target, rests } = &arguments.inputs;
    let files = InputFiles::read((source, target), rests, (arguments.config.as_deref(), &arguments.preset), &limits)?;
    let knowledge = arguments.rigs.read(&limits)?;

    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.progress);
    let result = engine::retarget_with(&files.inputs(&formats.distinct), &knowledge, &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| files.exit(&failure))?;
    tell_warnings(&outcome);
    check_strict(arguments.strict, &outcome)?;
    write_results(&outcome, &arguments.output, &formats, arguments.report.as_ref(), &control)?;
    tell_success(arguments, &outcome);
    Ok(())
}

fn tell_success(arguments: &Arguments, outcome: &Outcome) {
    let counts = &outcome.report.counts;
    let outputs: Vec<String> = arguments.output.iter().map(|path| path.display().to_string()).collect();
    say(format_args!(
        "wrote {}: {} frames, {} of {} target joints driven, {:.2} s",
        outputs.join(", "),
        counts.frames,
        counts.driven_joints,
        counts.target_joints,
        outcome.report.timings.total_seconds
    ));
}
