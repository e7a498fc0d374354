//! The `draw` subcommand: a scene of drawn characters, or one drawing and a motion, to what they do.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::ValueEnum;
use serde_json::json;

use crate::{
    engine::{
        self, DrawRequest, DrawSpec, DrawingFiles, Failure, FailureCode, FileReader, Knowledge, Limits, NamedBytes,
        Outcome,
    },
    formats::{Format, is_picture},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{BAD_USAGE, Exit, report, say},
    files::InputFile,
    limits::LimitArguments,
    outputs::{Destinations, tell_warnings, write_results},
    verdict::Judged,
    watch::{ProgressWatch, cancel_on_interrupt},
};

/// Arguments of `retargetd draw`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// A scene (MVC) config of *Animated Drawings*, or with --drawing a spec of ours with "task": "draw" (JSON or YAML)
    #[arg(long, value_name = "FILE", required_unless_present = "drawing")]
    config: Option<PathBuf>,
    /// The drawing: a folder or a zip archive with char_cfg.yaml, texture.png and mask.png; or a picture, which is annotated on the way
    #[arg(long, value_name = "DIR|ZIP|PICTURE", requires = "source")]
    drawing: Option<PathBuf>,
    /// The motion: a file with a clip, of any readable format
    #[arg(long, value_name = "FILE", requires = "drawing")]
    source: Option<PathBuf>,
    /// The clip of the source. Default: the first that moves
    #[arg(long, value_name = "NAME", requires = "source")]
    clip: Option<String>,
    /// A motion config of *Animated Drawings*, which says how a BVH source is read
    #[arg(long, value_name = "FILE", requires = "retarget")]
    motion: Option<PathBuf>,
    /// A retarget config of *Animated Drawings*, which says what of the source moves what of the drawing
    #[arg(long, value_name = "FILE", requires = "source")]
    retarget: Option<PathBuf>,
    /// A picture behind everything
    #[arg(long, value_name = "FILE")]
    background: Option<PathBuf>,
    /// Whose numbers come out. Without it, bones do not jump, have the angles that they are to have, and feet stand where they stand
    #[arg(long, value_enum)]
    compat: Option<Compat>,
    /// An archive with mesh_rest_vertices and mesh_triangles; it is deformed with the first character
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    /// Where the result goes; may be given several times. The ending picks the format: .gif, .webp, .png or .apng, .mp4: a moving picture; .zip:
    /// its frames as PNG; .glb: a textured model on bones; .npz, .json: the poses. Without it, where the scene says
    #[arg(long, short, value_name = "FILE")]
    output: Vec<PathBuf>,
    #[command(flatten)]
    destinations: Destinations,
    #[command(flatten)]
    limits: LimitArguments,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Compat {
    /// Those of the original program, including its quirks
    #[value(name = "animated_drawings")]
    AnimatedDrawings,
}

/// The files of the command line, read.
struct Given {
    config: Option<InputFile>,
    source: Option<InputFile>,
    motion: Option<InputFile>,
    retarget: Option<InputFile>,
    background: Option<InputFile>,
    mesh: Option<InputFile>,
    /// Where the drawing is an archive, or a picture alone.
    archive: Option<DrawingFiles>,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let limits = arguments.limits.limits;
    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let given = arguments.read(&limits, &control)?;
    let (spec, scene) = arguments.spec(&given)?;
    let outputs = arguments.places(scene)?;
    let formats = outputs.iter().map(|path| format_of(path)).collect::<Result<Vec<_>, _>>()?;
    arguments.destinations.check(&outputs, arguments.inputs())?;
    let watch = ProgressWatch::start(&control, arguments.destinations.progress);
    let result = arguments.drawn(&given, (spec, scene), &formats, (&limits, &control));
    drop(watch);
    let outcome = result.map_err(|failure| Exit::from_failure(&failure, ""))?;
    if let Some(report) = &outcome.report.drawing {
        report.choices.iter().for_each(|choice| say(format_args!("note: {choice}")));
    }
    tell_warnings(&outcome);
    write_results(&outcome, &outputs, &formats, arguments.destinations.report(), &control)?;
    let judged = outcome.report.drawing.as_ref().map(|report| Judged {
        verdict: report.verdict.name().to_owned(),
        reason: report.verdict_reason.clone(),
        coverage: None,
    });
    if let Some(judged) = &judged {
        judged.tell("");
    }
    let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
    let (frames, seconds) = (outcome.report.counts.frames, outcome.report.timings.total_seconds);
    say(format_args!("wrote {}: {frames} frames, {seconds:.2} s", names.join(", ")));
    report(|| {
        json!({
            "outputs": outputs,
            "report": arguments.destinations.report(),
            "counts": outcome.report.counts,
            "timings": outcome.report.timings,
            "warnings": outcome.report.warnings,
            "verdict": judged.as_ref().map(|judged| &judged.verdict),
            "verdict_reason": judged.as_ref().map(|judged| &judged.reason),
        })
    })?;
    arguments.destinations.judging.check([("the result", judged.as_ref())])
}

impl Arguments {
    fn inputs(&self) -> Vec<&Path> {
        let files = [&self.config, &self.source, &self.motion, &self.retarget, &self.background, &self.mesh];
        let archive = self.drawing.as_ref().filter(|path| path.is_file());
        files.into_iter().flatten().chain(archive).map(PathBuf::as_path).collect()
    }

    fn read(&self, limits: &Limits, control: &Control) -> Result<Given, Exit> {
        let read = |part: &str, path: &Option<PathBuf>| {
            path.as_deref().map(|path| InputFile::read(part, path, limits)).transpose()
        };
        let archive = match self.drawing.as_deref().filter(|path| !path.is_dir()) {
            None => None,
            Some(path) => {
                let file = InputFile::read("drawing", path, limits)?;
                let unpacked = DrawingFiles::read(file.as_named(), limits, control);
                let subject = format!("drawing {}", path.display());
                Some(unpacked.map_err(|failure| {
                    let hint =
                        "name a folder or a zip archive with char_cfg.yaml, texture.png and mask.png, or a picture";
                    let failure = if is_picture(file.as_named().bytes) { failure } else { failure.with_hint(hint) };
                    Exit::from_failure(&failure, &subject)
                })?)
            }
        };
        Ok(Given {
            config: read("config", &self.config)?,
            source: read("source", &self.source)?,
            motion: read("motion", &self.motion)?,
            retarget: read("retarget", &self.retarget)?,
            background: read("background", &self.background)?,
            mesh: read("mesh", &self.mesh)?,
            archive,
        })
    }

    /// What is wanted; and the place that a scene names, where the config is one.
    fn spec<'a>(&self, given: &'a Given) -> Result<(DrawSpec, Option<NamedBytes<'a>>), Exit> {
        let told = |failure: Failure| Exit::from_failure(&failure, "config");
        let config = given.config.as_ref().map(InputFile::as_named);
        let is_scene = self.drawing.is_none();
        let mut spec = engine::read_draw_spec(config.filter(|_| !is_scene)).map_err(told)?;
        if let Some(Compat::AnimatedDrawings) = self.compat {
            spec = spec.with_compat();
        }
        if let Some(clip) = &self.clip {
            spec = spec.with_clip(clip);
        }
        if self.destinations.strict {
            spec.strict = true;
        }
        Ok((spec, config.filter(|_| is_scene)))
    }

    /// Where results go.
    fn places(&self, scene: Option<NamedBytes<'_>>) -> Result<Vec<PathBuf>, Exit> {
        if !self.output.is_empty() {
            return Ok(self.output.clone());
        }
        let told = |failure: Failure| Exit::from_failure(&failure, "");
        let said = scene.map(engine::place_of_scene).transpose().map_err(told)?.flatten();
        said.map(|place| vec![PathBuf::from(place)]).ok_or_else(|| {
            let message = "nothing says where the picture goes".to_owned();
            Exit::new(BAD_USAGE, message, "name the place with --output")
        })
    }

    fn drawn(
        &self,
        given: &Given,
        (spec, scene): (DrawSpec, Option<NamedBytes<'_>>),
        formats: &[Format],
        (limits, control): (&Limits, &Control),
    ) -> Result<Outcome, Failure> {
        let folder = match (&self.drawing, &given.archive) {
            (Some(_), Some(archive)) => Some(archive.folder()?),
            (Some(folder), None) => Some(folder.display().to_string()),
            (None, _) => None,
        };
        let shown = self.config.as_ref().map(|path| path.display().to_string()).unwrap_or_default();
        let request = DrawRequest {
            scene: scene.map(|scene| NamedBytes { name: &shown, ..scene }),
            folder: folder.as_deref(),
            source: given.source.as_ref().map(InputFile::as_named),
            motion: given.motion.as_ref().map(InputFile::as_named),
            retarget: given.retarget.as_ref().map(InputFile::as_named),
            background: given.background.as_ref().map(InputFile::as_named),
            mesh: given.mesh.as_ref().map(InputFile::as_named),
            annotation: given.archive.as_ref().and_then(DrawingFiles::annotation),
            spec,
            formats,
        };
        let beside = self.config.as_deref().unwrap_or(Path::new("."));
        let mut read = |file: &str| match &given.archive {
            Some(archive) => archive.find(file).map(<[u8]>::to_vec).ok_or_else(|| archive.missing(file)),
            None => read_named(file, beside, limits),
        };
        let read: &mut FileReader<'_> = &mut read;
        engine::draw(&request, read, &Knowledge::default(), limits, control)
    }
}

/// The format that an ending asks for, of those that drawings are written in.
fn format_of(output: &Path) -> Result<Format, Exit> {
    let name = output.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    Format::from_file_name(&name).and_then(Format::of_drawing).ok_or_else(|| {
        let message = format!("output {}: drawings are not written in this format", output.display());
        Exit::new(BAD_USAGE, message, "end the name in .gif, .webp, .png, .apng, .mp4, .zip, .glb, .npz or .json")
    })
}

/// A file that a config names: where it is said to be, beside the scene, or beside one of the folders that the scene is in.
fn read_named(file: &str, scene: &Path, limits: &Limits) -> Result<Vec<u8>, Failure> {
    let beside = scene.ancestors().skip(1).map(|folder| folder.join(file));
    let found = std::iter::once(PathBuf::from(file)).chain(beside).find(|path| path.is_file());
    let Some(path) = found else {
        let detail = format!("there is no file {file}");
        let hint = "work in the folder that the paths of the configs begin in";
        return Err(Failure::new(FailureCode::UnknownName, detail).with_hint(hint));
    };
    let input = InputFile::read("file", &path, limits)
        .map_err(|exit| Failure::new(FailureCode::AssetLimitExceeded, exit.message).with_hint(exit.hint))?;
    Ok(input.as_named().bytes.to_vec())
}
