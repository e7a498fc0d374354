//! Results: which formats they are asked for in, where they go, and what is said about them.

use std::path::{Path, PathBuf};

use crate::{
    engine::{self, NamedBytes, Outcome, PreviewOptions},
    formats::{Format, Limits},
    model::Control,
    report::{Illustration, report_page},
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, one_line, say, to_json},
    files::{StagedFiles, check_place},
};

/// Where results go, and how strictly they are looked at.
#[derive(Debug, clap::Args)]
pub(super) struct OutputArguments {
    /// Output file; the extension selects the format. May be repeated
    #[arg(long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// Report file: an HTML page if the extension is .html, else JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Show a progress bar even on a dumb terminal; other terminals always show it, pipes never
    #[arg(long)]
    pub(super) progress: bool,
    /// Fail and write nothing if there is a warning or a failing measure; same as "strict": true in the config
    #[arg(long)]
    strict: bool,
    #[command(flatten)]
    overwriting: Overwriting,
}

/// Which files may be written over.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub(super) struct Overwriting {
    /// Allow overwriting an input file
    #[arg(long, conflicts_with = "no_clobber")]
    force: bool,
    /// Never overwrite an existing file
    #[arg(long)]
    no_clobber: bool,
}

impl Overwriting {
    /// Refuses outputs that would replace an input, or with `--no-clobber` any file.
    pub(super) fn check<'p>(
        self,
        inputs: impl IntoIterator<Item = &'p Path>,
        outputs: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), Exit> {
        let inputs: Vec<(&Path, Option<PathBuf>)> =
            inputs.into_iter().map(|path| (path, path.canonicalize().ok())).collect();
        for output in outputs {
            // What is not there yet is no input; what is no plain file (a pipe, a terminal) is not replaced.
            let Some(place) = output.canonicalize().ok().filter(|place| place.is_file()) else { continue };
            let shown = output.display();
            if self.no_clobber {
                let message = format!("output {shown}: the file exists");
                return Err(Exit::new(BAD_USAGE, message, "name another file, or leave out --no-clobber"));
            }
            let input = inputs.iter().find(|(_, input)| input.as_ref() == Some(&place));
            if let Some((input, _)) = input.filter(|_| !self.force) {
                let message = format!("output {shown}: this is the input {}", input.display());
                return Err(Exit::new(BAD_USAGE, message, "name another file, or write over the input with --force"));
            }
        }
        Ok(())
    }
}

impl OutputArguments {
    /// Finds out before the work which formats are wanted, that every file has a place to go, and that no input is written over.
    pub(super) fn check<'p>(&'p self, inputs: impl IntoIterator<Item = &'p Path>) -> Result<WantedFormats, Exit> {
        let formats = WantedFormats::of(&self.output)?;
        check_places(&self.output, self.report.as_ref())?;
        self.overwriting.check(inputs, self.output.iter().chain(&self.report).map(PathBuf::as_path))?;
        Ok(formats)
    }

    /// Tells the warnings and puts all results in their places; none where warnings are not wanted.
    pub(super) fn finish(&self, outcome: &Outcome, formats: &WantedFormats, control: &Control) -> Result<(), Exit> {
        tell_warnings(outcome);
        check_strict(self.strict, outcome)?;
        write_results(outcome, &self.output, formats, self.report.as_ref(), control)
    }

    /// The result files, as they are told to the user.
    pub(super) fn names(&self) -> String {
        let names: Vec<String> = self.output.iter().map(|path| path.display().to_string()).collect();
        names.join(", ")
    }
}

/// The formats that output files ask for, in their order, and each once.
pub(super) struct WantedFormats {
    pub(super) of_each: Vec<Format>,
    pub(super) distinct: Vec<Format>,
}

impl WantedFormats {
    /// By the endings of the files' names.
    pub(super) fn of(outputs: &[PathBuf]) -> Result<Self, Exit> {
        let of_each = outputs.iter().map(|path| output_format(path)).collect::<Result<Vec<_>, _>>()?;
        // What is asked for twice in the same format is made once.
        let mut distinct: Vec<Format> = Vec::new();
        for format in &of_each {
            if !distinct.contains(format) {
                distinct.push(*format);
            }
        }
        Ok(Self { of_each, distinct })
    }
}

/// Puts all results in their places, or none.
pub(super) fn write_results(
    outcome: &Outcome,
    outputs: &[PathBuf],
    formats: &WantedFormats,
    report: Option<&PathBuf>,
    control: &Control,
) -> Result<(), Exit> {
    let mut staged = StagedFiles::default();
    for (path, format) in outputs.iter().zip(&formats.of_each) {
        let output = outcome.outputs.iter().find(|output| output.format == *format).ok_or_else(|| {
            let message = format!("the engine gave no output of the format {}", format.info().name);
            Exit::new(FAILED, message, "this is a bug; please report it")
        })?;
        staged.add(path, &output.bytes)?;
    }
    if let Some(path) = report {
        staged.add(path, &report_file(outcome, path)?)?;
    }
    // The last look at Ctrl-C: from here on the result is put in place as a whole.
    control.check().map_err(|canceled| Exit::from_failure(&canceled.into(), ""))?;
    staged.commit()
}

/// Refuses what `strict` in the config refuses: results with warnings, and with measures that fail.
pub(super) fn check_strict(strict: bool, outcome: &Outcome) -> Result<(), Exit> {
    if !strict {
        return Ok(());
    }
    engine::check_strict(&outcome.report.warnings, outcome.report.measures.as_ref())
        .map_err(|failure| Exit::from_failure(&failure, ""))
}

/// The format that a file name's ending stands for, where it can be written.
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
            let message = format!("output {}: {}", path.display(), format.info().why_unwritten());
            Err(Exit::new(BAD_USAGE, message, hint))
        }
        None => Err(Exit::new(BAD_USAGE, format!("output {}: the ending stands for no format", path.display()), hint)),
    }
}

/// Finds out before the work whether its results have a place to go.
pub(super) fn check_places(outputs: &[PathBuf], report: Option<&PathBuf>) -> Result<(), Exit> {
    let places: Vec<&PathBuf> = outputs.iter().chain(report).collect();
    for (index, path) in places.iter().enumerate() {
        if places[..index].contains(path) {
            let message = format!("output {}: the same file is named twice", path.display());
            return Err(Exit::new(BAD_USAGE, message, "give every output a name of its own"));
        }
        check_place(path)?;
    }
    Ok(())
}

/// The report, and the spec that makes the same result again.
fn report_file(outcome: &Outcome, path: &Path) -> Result<Vec<u8>, Exit> {
    let failed = |error: serde_json::Error| Exit::new(FAILED, format!("the report cannot be written: {error}"), "");
    let mut report = serde_json::to_value(&outcome.report).map_err(failed)?;
    if let Some(members) = report.as_object_mut() {
        members.insert("resolved_spec".into(), outcome.resolved_spec.clone());
    }
    report_bytes(&report, path, &illustration(outcome, path))
}

/// What a page shows beside the report: the first result that can be drawn.
fn illustration(outcome: &Outcome, path: &Path) -> Illustration {
    if !is_page(path) {
        return Illustration::default();
    }
    let shown = outcome.outputs.iter().find(|output| output.format.info().reads);
    let about = shown.map(|output| ("result", output.name.clone())).into_iter().collect();
    let picture = shown.and_then(|output| {
        let file = NamedBytes { name: &output.name, bytes: &output.bytes };
        engine::preview(file, &PreviewOptions::of_report(), &Limits::default(), &Control::new()).ok()
    });
    Illustration { about, picture: picture.map(|preview| preview.bytes) }
}

fn is_page(path: &Path) -> bool {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
    matches!(ending.as_deref(), Some("html" | "htm"))
}

/// A report as it is written: as a page where the ending asks for one, else as JSON.
pub(super) fn report_bytes(
    report: &serde_json::Value,
    path: &Path,
    illustration: &Illustration,
) -> Result<Vec<u8>, Exit> {
    if is_page(path) {
        return Ok(report_page(report, illustration).into_bytes());
    }
    Ok(to_json(report)?.into_bytes())
}

pub(super) fn tell_warnings(outcome: &Outcome) {
    for warning in &outcome.report.warnings {
        let place = if warning.place.is_empty() { String::new() } else { format!("{}: ", warning.place) };
        let hint = if warning.hint.is_empty() { String::new() } else { format!(" ({})", warning.hint) };
        say(format_args!("warning: {}: {}", warning.code, one_line(&format!("{place}{}{hint}", warning.detail))));
    }
}
