//! The `retarget` subcommand: one clip onto one character, without a server.

use std::{path::PathBuf, process::ExitCode, sync::Arc};

use crate::{
    engine::{self, Failure, Inputs, Outcome},
    formats::{Format, Limits},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{Exit, say},
    files::InputFile,
    outputs::{WantedFormats, check_places, check_strict, tell_warnings, write_results},
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd retarget`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The file with the animation
    #[arg(long, value_name = "FILE")]
    source: PathBuf,
    /// The file with the character that the animation goes onto
    #[arg(long, value_name = "FILE")]
    target: PathBuf,
    /// The source rig in its rest pose, where the source file does not hold it
    #[arg(long, value_name = "FILE")]
    source_rest: Option<PathBuf>,
    /// The target rig in its rest pose, where the target file does not hold it
    #[arg(long, value_name = "FILE")]
    target_rest: Option<PathBuf>,
    /// The retarget spec (JSON or YAML); without it, everything is found out
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
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

/// The files of the command line, read.
struct InputFiles {
    source: InputFile,
    target: InputFile,
    source_rest: Option<InputFile>,
    target_rest: Option<InputFile>,
    config: Option<InputFile>,
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
    let files = InputFiles::read(arguments, &limits)?;

    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.progress);
    let result = engine::retarget(&files.inputs(&formats.distinct), &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| Exit::from_failure(&failure, &files.subject(&failure)))?;
    tell_warnings(&outcome);
    check_strict(arguments.strict, &outcome)?;
    write_results(&outcome, &arguments.output, &formats, arguments.report.as_ref(), &control)?;
    tell_success(arguments, &outcome);
    Ok(())
}

impl InputFiles {
    fn read(arguments: &Arguments, limits: &Limits) -> Result<Self, Exit> {
        let optional = |part: &str, path: &Option<PathBuf>| {
            path.as_ref().map(|path| InputFile::read(part, path, limits)).transpose()
        };
        Ok(Self {
            source: InputFile::read("source", &arguments.source, limits)?,
            target: InputFile::read("target", &arguments.target, limits)?,
            source_rest: optional("source_rest", &arguments.source_rest)?,
            target_rest: optional("target_rest", &arguments.target_rest)?,
            config: optional("config", &arguments.config)?,
        })
    }

    fn inputs<'a>(&'a self, formats: &'a [Format]) -> Inputs<'a> {
        Inputs {
            source: self.source.as_named(),
            target: self.target.as_named(),
            source_rest: self.source_rest.as_ref().map(InputFile::as_named),
            target_rest: self.target_rest.as_ref().map(InputFile::as_named),
            config: self.config.as_ref().map(InputFile::as_named),
            formats,
        }
    }

    /// What a failure is about, in the user's words.
    fn subject(&self, failure: &Failure) -> String {
        let file = match failure.part {
            "source" => Some(&self.source),
            "target" => Some(&self.target),
            "source_rest" => self.source_rest.as_ref(),
            "target_rest" => self.target_rest.as_ref(),
            "config" => self.config.as_ref(),
            _ => None,
        };
        file.map_or_else(|| failure.part.to_owned(), |file| format!("{} {}", failure.part, file.path.display()))
    }
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
