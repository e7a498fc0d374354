//! Results: which formats they are asked for in, where they go, and what is said about them.

use std::{
    fs::File,
    io::BufWriter,
    path::{Path, PathBuf},
};

use crate::{
    engine::{self, NamedBytes, Outcome, PreviewOptions},
    formats::{Format, Limits},
    model::Control,
    report::{Illustration, report_page},
};

use super::{
    clips,
    exit::{BAD_USAGE, Exit, FAILED, one_line, report, say, to_json},
    files::{StagedFiles, check_place, is_standard, unwritable},
    verdict::{Judged, Judging},
};

/// Where results go, and how strictly they are looked at.
#[derive(Debug, clap::Args)]
pub(super) struct OutputArguments {
    /// Where the result goes; the ending picks the format, and '-' is standard output. May be given several times
    #[arg(long, value_name = "FILE", required = true)]
    output: Vec<PathBuf>,
    /// The format of what goes to standard output ('--output -'), by its name or its ending; default glb
    #[arg(long, value_name = "FORMAT")]
    format: Option<String>,
    #[command(flatten)]
    pub(super) destinations: Destinations,
}

/// What goes beside results, and how strictly they are looked at.
#[derive(Debug, clap::Args)]
pub(super) struct Destinations {
    /// Where the report goes: as a page to look at where the ending is .html, else as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    /// Show a progress bar even on a dumb terminal; other terminals always show it, pipes never
    #[arg(long)]
    pub(super) progress: bool,
    /// Fail and write nothing if there is a warning or a failing measure; same as "strict": true in the config
    #[arg(long)]
    pub(super) strict: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    pub(super) judging: Judging,
}

impl Destinations {
    /// Finds out before the work whether results have places to go, and would not replace what they must not.
    pub(super) fn check<'p>(
        &'p self,
        outputs: &'p [PathBuf],
        inputs: impl IntoIterator<Item = &'p Path>,
    ) -> Result<(), Exit> {
        check_places(outputs, self.report.as_ref())?;
        self.overwriting.check(inputs, outputs.iter().chain(&self.report).map(PathBuf::as_path))
    }

    /// Where the report goes.
    pub(super) const fn report(&self) -> Option<&PathBuf> {
        self.report.as_ref()
    }
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
        let formats = self.formats()?;
        self.destinations.check(&self.output, inputs)?;
        Ok(formats)
    }

    /// The formats that are asked for.
    pub(super) fn formats(&self) -> Result<WantedFormats, Exit> {
        if self.format.is_some() && !self.output.iter().any(|path| is_standard(path)) {
            let hint = "the ending of each output picks its format; --format is for '--output -'";
            return Err(Exit::new(BAD_USAGE, "--format says nothing where nothing goes to standard output", hint));
        }
        WantedFormats::with(&self.output, self.format.as_deref())
    }

    /// Every file that is written.
    pub(super) fn files(&self) -> impl Iterator<Item = &PathBuf> {
        self.output.iter().chain(&self.destinations.report)
    }

    /// The same for one clip of a batch.
    pub(super) fn of_clip(&self, name: &str) -> (Vec<PathBuf>, Option<PathBuf>) {
        let named = |path: &PathBuf| clips::named(path, name);
        (self.output.iter().map(named).collect(), self.destinations.report.as_ref().map(named))
    }

    /// Puts the results of one clip of a batch in their places.
    pub(super) fn finish_clip(
        &self,
        outcome: &Outcome,
        name: &str,
        inputs: &[&Path],
        control: &Control,
    ) -> Result<(), Exit> {
        let (outputs, report) = self.of_clip(name);
        check_places(&outputs, report.as_ref())?;
        self.destinations
            .overwriting
            .check(inputs.iter().copied(), outputs.iter().chain(&report).map(PathBuf::as_path))?;
        check_strict(self.destinations.strict, outcome)?;
        write_results(outcome, &outputs, &self.formats()?.of_each, report.as_ref(), control)
    }

    /// Tells the warnings and puts all results in their places; none where warnings are not wanted.
    pub(super) fn finish(&self, outcome: &Outcome, formats: &WantedFormats, control: &Control) -> Result<(), Exit> {
        tell_warnings(outcome);
        check_strict(self.destinations.strict, outcome)?;
        write_results(outcome, &self.output, &formats.of_each, self.destinations.report(), control)
    }

    /// A file for each result that is written while it is made, all of them put in their places at the end.
    pub(super) fn stage(&self) -> Result<(StagedFiles, Vec<File>), Exit> {
        if self.output.iter().any(|path| is_standard(path)) {
            let message = "output -: a long clip is not written from its beginning to its end";
            return Err(Exit::new(BAD_USAGE, message, "name a file"));
        }
        let mut staged = StagedFiles::default();
        let files = self.output.iter().map(|path| staged.create(path)).collect::<Result<_, _>>()?;
        Ok((staged, files))
    }

    /// Sees to it that results which were written part by part are on the disk before they are put in their places.
    pub(super) fn sync(&self, files: Vec<BufWriter<File>>) -> Result<(), Exit> {
        for (file, path) in files.into_iter().zip(&self.output) {
            let file = file.into_inner().map_err(|error| unwritable(path, error.error()))?;
            file.sync_all().map_err(|error| unwritable(path, &error))?;
        }
        Ok(())
    }

    /// As [`Self::finish`], of results that are written.
    pub(super) fn finish_staged(
        &self,
        mut staged: StagedFiles,
        outcome: &Outcome,
        control: &Control,
    ) -> Result<(), Exit> {
        tell_warnings(outcome);
        check_strict(self.destinations.strict, outcome)?;
        if let Some(path) = self.destinations.report() {
            staged.add(path, &report_file(outcome, path)?)?;
        }
        control.check().map_err(|canceled| Exit::from_failure(&canceled.into(), ""))?;
        staged.commit()
    }

    /// Tells the verdict and what was written, and ends the command where the verdict is worse than is asked for.
    pub(super) fn judge(&self, outcome: &Outcome, wrote: &str) -> Result<(), Exit> {
        let judged = Judged::of(outcome);
        if let Some(judged) = &judged {
            judged.tell("");
        }
        if let Some(speed) = outcome.report.measures.as_ref().and_then(|measures| measures.floor_speed()) {
            say(format_args!("floor: {speed}"));
        }
        say(format_args!("wrote {}: {wrote}", self.names()));
        report(|| self.view(outcome, judged.as_ref()))?;
        self.destinations.judging.check([("the result", judged.as_ref())])
    }

    /// What was done, for programs.
    fn view(&self, outcome: &Outcome, judged: Option<&Judged>) -> serde_json::Value {
        let mut view = serde_json::json!({
            "outputs": self.output,
            "report": self.destinations.report,
            "counts": outcome.report.counts,
            "timings": outcome.report.timings,
            "warnings": outcome.report.warnings,
        });
        if let (Some(judged), Some(members)) = (judged, view.as_object_mut())
            && let Ok(serde_json::Value::Object(judged)) = serde_json::to_value(judged)
        {
            members.extend(judged);
        }
        view
    }

    /// The result files, as they are told to the user.
    fn names(&self) -> String {
        let name = |path: &PathBuf| match is_standard(path) {
            true => "to standard output".to_owned(),
            false => path.display().to_string(),
        };
        self.output.iter().map(name).collect::<Vec<_>>().join(", ")
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
        Self::with(outputs, None)
    }

    /// The same; what goes to standard output has the format of that name.
    fn with(outputs: &[PathBuf], standard: Option<&str>) -> Result<Self, Exit> {
        let format = |path: &PathBuf| match is_standard(path) {
            true => format_called(standard.unwrap_or("glb")),
            false => output_format(path),
        };
        let of_each = outputs.iter().map(format).collect::<Result<Vec<_>, _>>()?;
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
    formats: &[Format],
    report: Option<&PathBuf>,
    control: &Control,
) -> Result<(), Exit> {
    let mut staged = StagedFiles::default();
    for (path, format) in outputs.iter().zip(formats) {
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

/// The format of that name or ending, where it can be written.
fn format_called(name: &str) -> Result<Format, Exit> {
    let format =
        Format::from_name(name).or_else(|| Format::from_file_name(&format!(".{}", name.trim_start_matches('.'))));
    format.filter(|format| format.info().writes).ok_or_else(|| {
        let writable = Format::ALL.iter().map(|format| format.info()).filter(|info| info.writes);
        let names = writable.map(|info| info.name).collect::<Vec<_>>().join(", ");
        Exit::new(
            BAD_USAGE,
            format!("--format {name}: nothing of that name can be written"),
            format!("use one of {names}"),
        )
    })
}

/// The format that a file name's ending stands for, where it can be written.
pub(super) fn output_format(path: &Path) -> Result<Format, Exit> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let mut writable: Vec<String> = Vec::new();
    for ending in Format::ALL.iter().filter(|format| format.info().writes).flat_map(|format| format.info().endings) {
        let ending = format!(".{ending}");
        // Drawings share endings with figures.
        if !writable.contains(&ending) {
            writable.push(ending);
        }
    }
    let hint = format!("use one of {}", writable.join(" "));
    match Format::from_file_name(&name) {
        Some(format) if format.info().writes => Ok(format),
        Some(format) => {
            let message = format!("output {}: {}", path.display(), format.info().why_unwritten());
            Err(Exit::new(BAD_USAGE, message, hint))
        }
        None if path.is_dir() => Err(Exit::new(
            BAD_USAGE,
            format!("output {}: this is a folder", path.display()),
            format!("name a file in it, such as {}", path.join("out.glb").display()),
        )),
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
