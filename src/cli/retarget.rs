//! The `retarget` subcommand: one clip onto one character, without a server.

use std::{process::ExitCode, sync::Arc};

use crate::{
    engine::{self, Outcome},
    formats::Limits,
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{Exit, one_line, say},
    inputs::InputPaths,
    outputs::OutputArguments,
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd retarget`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    #[command(flatten)]
    inputs: InputPaths,
    #[command(flatten)]
    outputs: OutputArguments,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match retarget(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn retarget(arguments: &Arguments) -> Result<(), Exit> {
    let formats = arguments.outputs.check(arguments.inputs.paths())?;
    let limits = Limits::default();
    let (files, knowledge) = arguments.inputs.read(&limits)?;

    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.outputs.destinations.progress);
    let result = engine::retarget_with(&files.inputs(&formats.distinct), &knowledge, &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| files.exit(&failure))?;
    arguments.outputs.finish(&outcome, &formats, &control)?;
    tell_success(arguments, &outcome);
    Ok(())
}

fn tell_success(arguments: &Arguments, outcome: &Outcome) {
    let counts = &outcome.report.counts;
    if let Some(measures) = &outcome.report.measures {
        say(format_args!("verdict: {}: {}", measures.verdict.name(), one_line(&measures.verdict_reason)));
    }
    say(format_args!(
        "wrote {}: {} frames, {} of {} target joints driven, {:.2} s",
        arguments.outputs.names(),
        counts.frames,
        counts.driven_joints,
        counts.target_joints,
        outcome.report.timings.total_seconds,
    ));
}
