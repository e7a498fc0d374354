//! The `retarget` subcommand: one clip onto one character, without a server.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use crate::{
    engine::{self, Outcome},
    formats::{Format, Limits},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, one_line, say, to_json},
    files::{StagedFiles, check_place},
    inputs::{InputFiles, InputPaths},
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
    let formats = arguments.output.iter().map(|path| output_format(path)).collect::<Result<Vec<_>, _>>()?;
    check_places(arguments)?;
    let limits = Limits::default();
    let InputPaths { source, target, rests } = &arguments.inputs;
    let files = InputFiles::read((source, target), rests, (arguments.config.as_deref(), &arguments.preset), &limits)?;
    let knowledge = arguments.rigs.read(&limits)?;
    // What is asked for twice in the same format is made once.
    let mut wanted: Vec<Format> = Vec::new();
    for format in &formats {
        if !wanted.contains(format) {
            wanted.push(*format);
        }
    }

    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let watch = ProgressWatch::start(&control, arguments.progress);
    let result = engine::retarget_with(&files.inputs(&wanted), &knowledge, &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| files.exit(&failure))?;
    tell_warnings(&outcome);
    if arguments.strict && !outcome.report.warnings.is_empty() {
        let message = format!("--strict: there are {} warnings, so nothing was written", outcome.report.warnings.len());
        return Err(Exit::new(INPUT_REFUSED, message, "mend what the warnings name, or leave out --strict"));
    }

    let mut staged = StagedFiles::default();
    for (path, format) in arguments.output.iter().zip(&formats) {
        let output = outcome.outputs.iter().find(|output| output.format == *format).ok_or_else(|| {
            let name = format.info().name;
            Exit::new(
                FAILED,
                format!("the engine gave no output of the format {name}"),
                "this is a bug; please report it",
            )
        })?;
        staged.add(path, &output.bytes)?;
    }
    if let Some(path) = &arguments.report {
        staged.add(path, &report_file(&outcome, path)?)?;
    }
    // The last look at Ctrl-C: from here on the result is put in place as a whole.
    control.check().map_err(|canceled| Exit::from_failure(&canceled.into(), ""))?;
    staged.commit()?;
    tell_success(arguments, &outcome);
    Ok(())
}

pub(super) fn output_format(path: &Path) -> Result<Format, Exit> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let writable: Vec<String> = Format::ALL
        .iter()
        .filter(|format| format.info().writes)
        .flat_map(|format| format.info().endings)
        .map(|ending| format!(".{ending}"))
        .collect();
    let hint = format!("use one of {}", writable.join(" "));
    match Format::from_file_name(&name) {
        Some(format) if format.info().writes => Ok(format),
        Some(format) => {
            let message = format!("output {}: {} is read but not written", path.display(), format.info().description);
            Err(Exit::new(BAD_USAGE, message, hint))
        }
        None => Err(Exit::new(BAD_USAGE, format!("output {}: the ending stands for no format", path.display()), hint)),
    }
}

/// Finds out before the work whether its results have a place to go.
fn check_places(arguments: &Arguments) -> Result<(), Exit> {
    let places: Vec<&PathBuf> = arguments.output.iter().chain(&arguments.report).collect();
    for (index, path) in places.iter().enumerate() {
        if places[..index].contains(path) {
            let message = format!("output {}: the same file is named twice", path.display());
            return Err(Exit::new(BAD_USAGE, message, "give every output a name of its own"));
        }
        check_place(path)?;
    }
    Ok(())
}

/// The report, and the spec that makes the same result again; as a page where the ending asks for one.
fn report_file(outcome: &Outcome, path: &Path) -> Result<Vec<u8>, Exit> {
    let failed = |error: serde_json::Error| Exit::new(FAILED, format!("the report cannot be written: {error}"), "");
    let mut report = serde_json::to_value(&outcome.report).map_err(failed)?;
    if let Some(members) = report.as_object_mut() {
        members.insert("resolved_spec".into(), outcome.resolved_spec.clone());
    }
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    if matches!(ending.as_deref(), Some("html" | "htm")) {
        return Ok(engine::report_page(&report).into_bytes());
    }
    Ok(to_json(&report)?.into_bytes())
}

pub(super) fn tell_warnings(outcome: &Outcome) {
    for warning in &outcome.report.warnings {
        let place = if warning.place.is_empty() { String::new() } else { format!("{}: ", warning.place) };
        let hint = if warning.hint.is_empty() { String::new() } else { format!(" ({})", warning.hint) };
        say(format_args!("warning: {}: {}", warning.code, one_line(&format!("{place}{}{hint}", warning.detail))));
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
