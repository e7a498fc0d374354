//! The `retarget` subcommand: one clip onto one character, without a server.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use crate::{
    engine::{self, Failure, Inputs, Outcome},
    formats::{Format, Limits},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, one_line, say},
    files::{InputFile, StagedFiles},
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
    let formats = arguments.output.iter().map(|path| output_format(path)).collect::<Result<Vec<_>, _>>()?;
    check_places(arguments)?;
    let limits = Limits::default();
    let files = InputFiles::read(arguments, &limits)?;
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
    let result = engine::retarget(&files.inputs(&wanted), &limits, &control);
    drop(watch);
    let outcome = result.map_err(|failure| Exit::from_failure(&failure, &files.subject(&failure)))?;
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
        staged.add(path, &report_json(&outcome)?)?;
    }
    // The last look at Ctrl-C: from here on the result is put in place as a whole.
    control.check().map_err(|canceled| Exit::from_failure(&canceled.into(), ""))?;
    staged.commit()?;
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

/// Whether a file can be put there.
pub(super) fn check_place(path: &Path) -> Result<(), Exit> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        let message = format!("output {}: there is no folder {}", path.display(), folder.display());
        return Err(Exit::new(BAD_USAGE, message, "make the folder first"));
    }
    if path.is_dir() {
        let message = format!("output {}: this is a folder, not a file", path.display());
        return Err(Exit::new(BAD_USAGE, message, "name a file in it"));
    }
    Ok(())
}

/// The report, and the spec that makes the same result again.
fn report_json(outcome: &Outcome) -> Result<Vec<u8>, Exit> {
    let failed = |error: serde_json::Error| Exit::new(FAILED, format!("the report cannot be written: {error}"), "");
    let mut report = serde_json::to_value(&outcome.report).map_err(failed)?;
    if let Some(members) = report.as_object_mut() {
        members.insert("resolved_spec".into(), outcome.resolved_spec.clone());
    }
    let mut bytes = serde_json::to_vec_pretty(&report).map_err(failed)?;
    bytes.push(b'\n');
    Ok(bytes)
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
