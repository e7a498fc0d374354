//! Drawings that move: a drawn character and a motion, or a scene of *Animated Drawings*, to pictures, to a model and to poses.
//!
//! | file | what it answers |
//! | --- | --- |
//! | `files` | where the files of a drawing come from: an archive, or whoever asks |
//! | `motion` | a clip of any rig as the motion of a body |
//! | `stage` | configs, pictures and motions to characters that move |
//! | `arrays` | what they do, as arrays |
//! | `background` | what is behind them |
//! | `film` | what they look like, as moving pictures |
//! | `model` | a character as a textured model on bones |
//! | `report` | how good it is |

mod arrays;
mod background;
mod files;
mod film;
mod model;
mod motion;
mod report;
mod stage;

pub use files::DrawingFiles;
pub use report::{DrawnCharacterView, DrawnReport};
use stage::Scenery;
pub use stage::place_of_scene;

use rayon::prelude::*;

use crate::{
    drawing::{DrawSpec, parse_draw_spec},
    formats::{Format, Limits},
    model::{Control, Phase, Reporter},
    picture::PictureFormat,
};

use super::{
    AnnotationView, Counts, Failure, FailureCode, Knowledge, NamedBytes, Outcome, Output, Report, RigFacts, Rigs,
    Timings, WarningView, files::in_config, outputs::file_stem, preview::check_built,
};

/// What finds the files that configs name, by the names as they are written.
pub type FileReader<'a> = dyn FnMut(&str) -> Result<Vec<u8>, Failure> + 'a;

/// The files of a drawing that is to move.
#[derive(Clone, Copy, Debug)]
pub struct DrawInputs<'a> {
    /// The file with the motion. Only a scene does without.
    pub source: Option<NamedBytes<'a>>,
    /// The drawing, as an archive.
    pub drawing: NamedBytes<'a>,
    /// What goes beside it, as an archive: `mvc.yaml`, `motion.yaml`, `retarget.yaml`, a picture for the background.
    pub scene: Option<NamedBytes<'a>>,
    /// The spec, JSON or YAML.
    pub config: Option<NamedBytes<'a>>,
    /// Formats that the caller wants; they win over the spec's `output`. Empty: what the spec says, else GIF.
    pub formats: &'a [Format],
}

/// A drawing that is to move, with everything that was found.
#[derive(Clone, Debug, Default)]
pub struct DrawRequest<'a> {
    /// The config of a scene of *Animated Drawings*.
    pub scene: Option<NamedBytes<'a>>,
    /// The folder of the drawing, which has `char_cfg.yaml`, `texture.png` and `mask.png`.
    pub folder: Option<&'a str>,
    /// The file with the motion.
    pub source: Option<NamedBytes<'a>>,
    /// A motion config of *Animated Drawings*.
    pub motion: Option<NamedBytes<'a>>,
    /// A retarget config of *Animated Drawings*.
    pub retarget: Option<NamedBytes<'a>>,
    /// A picture behind everything.
    pub background: Option<NamedBytes<'a>>,
    /// An archive with `mesh_rest_vertices` and `mesh_triangles`, which is deformed with the first character.
    pub mesh: Option<NamedBytes<'a>>,
    /// What was found in the drawing, where it was annotated on the way.
    pub annotation: Option<&'a AnnotationView>,
    /// What is wanted.
    pub spec: DrawSpec,
    /// Formats that the caller wants; they win over the spec's `output`.
    pub formats: &'a [Format],
}

/// Codes of what was chosen, in which nothing is wrong.
const CHOICES: [&str; 4] = ["drawing_annotated", "drawing_motion", "drawing_planes", "drawing_followed"];

/// Codes of what may be wrong, with what can be done about it.
const WARNINGS: [(&str, &str); 3] = [
    ("drawing_check_failed", "draw the joints where the config expects them, or leave the check out"),
    ("drawing_field_not_used", "leave the fields out"),
    ("drawing_joint_unknown", "name joints of the motion in bvh_projection_bodypart_groups"),
];

/// Reads a spec; without one, everything is found out.
///
/// # Errors
/// When it is no document, or a field is wrong.
pub fn read_draw_spec(config: Option<NamedBytes<'_>>) -> Result<DrawSpec, Failure> {
    config.map_or_else(|| Ok(DrawSpec::default()), |config| parse_draw_spec(config.bytes).map_err(in_config))
}

/// Lets a drawing of an archive move.
pub(super) fn drawn(
    inputs: &DrawInputs<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Outcome, Failure> {
    control.enter(Phase::Read, 0);
    let spec = read_draw_spec(inputs.config)?;
    let own = DrawingFiles::read(inputs.drawing, limits, control).map_err(|failure| failure.in_part("target"))?;
    let beside = inputs.scene.map(|scene| DrawingFiles::unpack(scene.bytes, limits, control)).transpose();
    let beside = beside.map_err(|failure| failure.in_part("scene"))?.unwrap_or_default();
    let scene = match &spec.scene {
        Some(name) => Some((name.as_str(), own.find(name).ok_or_else(|| own.missing(name))?)),
        None => beside.named("mvc.yaml"),
    };
    let folder = if scene.is_none() { Some(own.folder()?) } else { None };
    let request = DrawRequest {
        scene: scene.map(as_file),
        folder: folder.as_deref(),
        source: inputs.source,
        motion: beside.named("motion.yaml").map(as_file),
        retarget: beside.named("retarget.yaml").map(as_file),
        background: beside.background().map(as_file),
        mesh: None,
        annotation: own.annotation(),
        spec: spec.clone(),
        formats: inputs.formats,
    };
    let mut read = |name: &str| {
        let found = own.find(name).or_else(|| beside.find(name));
        found.map(<[u8]>::to_vec).ok_or_else(|| own.missing(name))
    };
    draw(&request, &mut read, knowledge, limits, control)
}

const fn as_file<'a>((name, bytes): (&'a str, &'a [u8])) -> NamedBytes<'a> {
    NamedBytes { name, bytes }
}

/// Lets a drawing move. `read` finds the files that configs name.
///
/// # Errors
/// With the file and the field of what is wrong; when there is nothing to move, or the work is canceled.
pub fn draw(
    request: &DrawRequest<'_>,
    read: &mut FileReader<'_>,
    knowledge: &Knowledge,
    limits: &Limits,
    control: &Control,
) -> Result<Outcome, Failure> {
    let begin = control.seconds();
    control.enter(Phase::Read, 0);
    let formats = wanted(request)?;
    let mut reporter = Reporter::new();
    let mut scenery = stage::set(request, read, (knowledge, limits), control, &mut reporter)?;
    if let Some(annotation) = request.annotation {
        let sure = annotation.confidence * 100.0;
        let text = format!(
            "the drawing was annotated: {}, {sure:.0} % sure; retargetd annotate writes its joints",
            annotation.rig
        );
        scenery.notes.insert(0, ("drawing_annotated", text));
    }
    let planned = control.seconds();
    let frames = scenery.characters.iter().map(|character| character.performance.frames).max().unwrap_or(0);
    control.enter(Phase::Retarget, frames as u64);
    let are_poses = |format: &Format| matches!(format, Format::Poses2dNpz | Format::Poses2dJson);
    // Poses need no pictures, and take no time for a mesh.
    let needs_pictures = !formats.iter().all(are_poses);
    let shown = needs_pictures.then(|| film::Shown::new(&scenery, request, read)).transpose()?;
    let placed = control.seconds();
    let measured = report::measured(&scenery, shown.as_ref(), request, control)?;
    let written = control.seconds();
    control.enter(Phase::Write, formats.len() as u64);
    let stem = file_stem(&scenery.name);
    let mut outputs = Vec::new();
    for format in formats {
        control.check()?;
        let bytes = match format {
            Format::Poses2dNpz => arrays::npz(&scenery, request.mesh, control)?,
            Format::Poses2dJson => arrays::json(&scenery, request.mesh, control)?,
            Format::Glb => model::glb(&scenery, read, request.source, control)?,
            format => {
                let shown = shown.as_ref().ok_or_else(|| unwritten(format))?;
                pictured(shown, format, control)?
            }
        };
        outputs.push(Output { format, name: format!("{stem}.{}", format.info().endings[0]), bytes });
        control.advance(1);
    }
    for (code, text) in scenery.notes.iter().filter(|(code, _)| !CHOICES.contains(code)) {
        let hint = WARNINGS.iter().find(|(other, _)| other == code).map_or("", |(_, hint)| hint);
        reporter.warn(code, "drawing", text.clone(), hint);
    }
    let mut warnings = request.annotation.map_or_else(Vec::new, |annotation| annotation.warnings.clone());
    warnings.extend(reporter.into_warnings().into_iter().map(WarningView::from));
    if request.spec.strict {
        report::check_strict(&warnings, &measured)?;
    }
    let end = control.seconds();
    let timings = Timings {
        read_seconds: planned - begin,
        plan_seconds: placed - planned,
        measure_seconds: written - placed,
        write_seconds: end - written,
        total_seconds: end - begin,
        ..Timings::default()
    };
    let resolved_spec = scenery.resolved(&request.spec, &outputs)?;
    let report = Report {
        timings,
        counts: scenery.counts(),
        warnings,
        rigs: Rigs { source: scenery.source_facts.clone(), target: RigFacts::default() },
        drawing: Some(measured),
        ..Report::default()
    };
    Ok(Outcome { outputs, report, resolved_spec })
}

/// The scene as pictures.
fn pictured(shown: &film::Shown<'_>, format: Format, control: &Control) -> Result<Vec<u8>, Failure> {
    if format == Format::PngZip {
        return shown.stills(control);
    }
    let picture = PictureFormat::of_ending(format.info().endings[0], true).ok_or_else(|| unwritten(format))?;
    check_built(picture)?;
    shown.film(picture, control)
}

/// The formats that are made, each once, in the order asked for.
fn wanted(request: &DrawRequest<'_>) -> Result<Vec<Format>, Failure> {
    let named = |name: &str| {
        Format::from_name(name).ok_or_else(|| {
            let detail = format!("there is no output format '{name}'; there are {}", writable());
            Failure::new(FailureCode::InvalidValue, detail).in_part("config")
        })
    };
    let mut asked = request.formats.to_vec();
    if asked.is_empty() {
        asked = request.spec.formats().into_iter().map(named).collect::<Result<_, _>>()?;
    }
    if asked.is_empty() {
        asked.push(Format::Gif);
    }
    let mut formats = Vec::new();
    for format in asked {
        let format = format.of_drawing().ok_or_else(|| unwritten(format))?;
        if !format.info().writes {
            return Err(Failure::new(FailureCode::UnsupportedFormat, format.info().why_unwritten())
                .with_hint(format!("ask for one of {}", writable())));
        }
        if !formats.contains(&format) {
            formats.push(format);
        }
    }
    Ok(formats)
}

fn unwritten(format: Format) -> Failure {
    let detail = format!("drawings are not written as {}", format.info().name);
    Failure::new(FailureCode::UnsupportedFormat, detail).with_hint(format!("ask for one of {}", writable()))
}

fn writable() -> String {
    let formats = Format::ALL.into_iter().filter(|format| format.of_drawing() == Some(*format) && format.info().writes);
    formats.map(|format| format.info().name).collect::<Vec<_>>().join(", ")
}

/// Makes pictures of frames of so many pixels, some at a time, and hands them on in their order. While some are taken, the next are made.
fn in_order<T: Send>(
    (frames, pixels): (usize, usize),
    control: &Control,
    make: impl Fn(usize) -> T + Sync + Send,
    mut take: impl FnMut(Vec<T>) -> Result<(), Failure> + Send,
) -> Result<(), Failure> {
    /// Pixels that are made at a time: 16 MB. As many are held that are being taken.
    const PIXELS_AT_A_TIME: usize = 4 << 20;
    let at_a_time = (PIXELS_AT_A_TIME / pixels.max(1)).clamp(2, 32);
    let mut ready = Vec::new();
    for begin in (0..frames).step_by(at_a_time) {
        control.check()?;
        let numbers = begin..(begin + at_a_time).min(frames);
        let before = std::mem::take(&mut ready);
        let (taken, made) = rayon::join(
            || if before.is_empty() { Ok(()) } else { take(before) },
            || numbers.into_par_iter().with_max_len(1).map(&make).collect(),
        );
        taken?;
        ready = made;
    }
    if ready.is_empty() { Ok(()) } else { take(ready) }
}

impl Scenery {
    /// The counts of a report.
    fn counts(&self) -> Counts {
        Counts {
            frames: self.characters.iter().map(|character| character.performance.frames).max().unwrap_or(0),
            source_joints: self.characters.iter().map(|character| character.motion.joints()).max().unwrap_or(0),
            target_joints: self.characters.iter().map(|character| character.rig.rest.len()).sum(),
            driven_joints: self.characters.iter().map(|character| character.performance.driven.len()).sum(),
        }
    }
}
