//! The `annotate` subcommand: a picture of a figure to a folder that `draw` reads.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use clap::ValueEnum;

use crate::{
    engine::{self, AnnotatedDrawing, BodyKind, MAX_MODEL_BYTES, PoseModel},
    model::Control,
    telemetry::monotonic_seconds,
};

use super::{
    exit::{BAD_USAGE, Exit, FAILED, INPUT_REFUSED, print, say, to_json},
    files::{InputFile, StagedFiles},
    limits::LimitArguments,
    outputs::Overwriting,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd annotate`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The picture: PNG, JPEG or WebP, of one figure on paper or on nothing
    #[arg(value_name = "PICTURE")]
    picture: PathBuf,
    /// The folder that char_cfg.yaml, texture.png, mask.png, joint_overlay.png and bounding_box.yaml go to; it is made where it is not there.
    /// May be left out with --json
    #[arg(long, short, value_name = "FOLDER", required_unless_present = "json")]
    output: Option<PathBuf>,
    /// Which pixels are the figure's: a picture of the same size, white or opaque where it is. It wins over what is found
    #[arg(long, value_name = "FILE")]
    mask: Option<PathBuf>,
    /// What kind of body it is. Any other kind is refused; auto takes the one that fits
    #[arg(long, value_enum, default_value_t = RigWord::Auto)]
    rig: RigWord,
    /// A pose model that finds the joints of human figures: an ONNX file, in builds with the feature pose-model
    #[arg(long, value_name = "FILE")]
    pose_model: Option<PathBuf>,
    /// Print what was found as one JSON object: joints with confidence, box, mask, warnings
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    overwriting: Overwriting,
    #[command(flatten)]
    limits: LimitArguments,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum RigWord {
    /// The kind that fits
    Auto,
    /// Head, arms and legs, from the front
    Humanoid,
    /// Four legs, from the side
    Quadruped,
    /// A chain of three joints for each limb that stands out
    Chains,
}

impl RigWord {
    const fn kind(self) -> Option<BodyKind> {
        match self {
            Self::Auto => None,
            Self::Humanoid => Some(BodyKind::Humanoid),
            Self::Quadruped => Some(BodyKind::Quadruped),
            Self::Chains => Some(BodyKind::Chains),
        }
    }
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let limits = arguments.limits.limits;
    let picture = InputFile::read("picture", &arguments.picture, &limits)?;
    let mask = arguments.mask.as_deref().map(|mask| InputFile::read("mask", mask, &limits)).transpose()?;
    let control = Arc::new(Control::with_clock(monotonic_seconds));
    cancel_on_interrupt(&control);
    let kind = arguments.rig.kind();
    let model = arguments.pose_model.as_deref().map(|model| read_pose_model(model, &control)).transpose()?;
    let mask = mask.as_ref().map(InputFile::as_named);
    let drawing = engine::annotate_drawing(picture.as_named(), mask, kind, model.as_ref(), &control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("picture {}", arguments.picture.display())))?;
    let view = drawing.view();
    if !arguments.json {
        for warning in &view.warnings {
            say(format_args!("warning: {}: {}: {}", warning.code, warning.place, warning.detail));
        }
        let (rig, joints, sure) = (view.rig, view.skeleton.len(), view.confidence * 100.0);
        say(format_args!("{rig}: {joints} joints, {sure:.0} % sure; joint_overlay.png shows them"));
        if arguments.pose_model.is_some() {
            say(format_args!("the pose model found {} of them", view.joints_by_model));
        }
    }
    if let Some(folder) = &arguments.output {
        let inputs = [Some(arguments.picture.as_path()), arguments.mask.as_deref()];
        write(folder, &drawing, arguments.overwriting, inputs.into_iter().flatten())?;
    }
    if arguments.json { print(&to_json(&view)?) } else { Ok(()) }
}

/// A model from its file, tried out.
fn read_pose_model(path: &Path, control: &Control) -> Result<PoseModel, Exit> {
    let shown = path.display();
    let refused =
        |detail: String| Exit::new(INPUT_REFUSED, format!("pose model {shown}: {detail}"), "give an ONNX file");
    let size = fs::metadata(path).map_err(|error| refused(format!("it cannot be read: {error}")))?.len();
    if size > MAX_MODEL_BYTES as u64 {
        return Err(refused(format!("it has {size} bytes; {MAX_MODEL_BYTES} are the most")));
    }
    let bytes = fs::read(path).map_err(|error| refused(format!("it cannot be read: {error}")))?;
    // Tried out first, so that what is wrong with it is told by its name.
    engine::tried_pose_model(bytes, control)
        .map_err(|failure| Exit::from_failure(&failure, &format!("pose model {shown}")))
}

/// Writes all files of a character folder, or none.
fn write<'p>(
    folder: &Path,
    drawing: &AnnotatedDrawing,
    overwriting: Overwriting,
    inputs: impl IntoIterator<Item = &'p Path>,
) -> Result<(), Exit> {
    let shown = folder.display();
    if folder.exists() && !folder.is_dir() {
        let message = format!("output {shown}: this is a file, not a folder");
        return Err(Exit::new(BAD_USAGE, message, "name a folder"));
    }
    let files = drawing.files().map_err(|failure| Exit::from_failure(&failure, ""))?;
    let inputs: Vec<&Path> = inputs.into_iter().collect();
    let places: Vec<PathBuf> = files.iter().map(|(name, _)| folder.join(name)).collect();
    overwriting.check(inputs, places.iter().map(PathBuf::as_path))?;
    fs::create_dir_all(folder)
        .map_err(|error| Exit::new(FAILED, format!("output {shown}: the folder cannot be made: {error}"), ""))?;
    let mut staged = StagedFiles::default();
    for ((_, bytes), place) in files.iter().zip(&places) {
        staged.add(place, bytes)?;
    }
    staged.commit()?;
    say(format_args!("wrote {shown}"));
    Ok(())
}
