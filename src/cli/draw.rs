//! The `draw` subcommand: a scene of drawn characters, or one drawing and a motion, to what they do.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use clap::ValueEnum;

use crate::{
    engine::{self, Failure, FailureCode, Limits, Manner, NamedBytes, PictureFormat, Scenery},
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, say},
    files::{InputFile, StagedFiles, check_place},
    outputs::Overwriting,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd draw`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The config of a scene, as *Animated Drawings* reads it
    #[arg(long, value_name = "FILE", required_unless_present = "drawing", conflicts_with_all = ["drawing", "motion", "clip"])]
    config: Option<PathBuf>,
    /// A folder with a drawing: char_cfg.yaml, texture.png and mask.png
    #[arg(long, value_name = "FOLDER", requires = "motion")]
    drawing: Option<PathBuf>,
    /// The motion: a file with a clip, of any readable format
    #[arg(long, value_name = "FILE", requires = "drawing")]
    motion: Option<PathBuf>,
    /// The clip of the motion. Default: the first that moves
    #[arg(long, value_name = "NAME", requires = "motion")]
    clip: Option<String>,
    /// Reproduces the numbers of another program. Without it, bones have no jumps and exact angles, and parts rarely change their order
    #[arg(long, value_enum, conflicts_with = "drawing")]
    compat: Option<Compat>,
    /// Output file; .npz: the poses as arrays; .gif, .webp, .apng, .mp4: a moving picture. Without it, the output of the scene
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// An archive with mesh_rest_vertices and mesh_triangles, deformed with the first character
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    #[command(flatten)]
    overwriting: Overwriting,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Compat {
    /// Those of the original program, including its quirks
    #[value(name = "animated_drawings")]
    AnimatedDrawings,
}

/// Codes of what was chosen, in which nothing is wrong.
const CHOICES: [&str; 3] = ["drawing_motion", "drawing_planes", "drawing_in_place"];

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match draw(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn draw(arguments: &Arguments) -> Result<(), Exit> {
    let limits = Limits::default();
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let mesh = arguments.mesh.as_deref().map(|path| InputFile::read("mesh", path, &limits)).transpose()?;
    let beside = arguments.config.as_deref().unwrap_or(Path::new("."));
    let mut read = |file: &str| read_named(file, beside, &limits);
    let told = |failure: Failure| Exit::from_failure(&failure, "");
    let scenery = arguments.scenery(&mut read, &limits, &control)?;
    let output = arguments.place(&scenery)?;
    check_place(&output)?;
    let inputs = [arguments.config.as_deref(), arguments.motion.as_deref(), arguments.mesh.as_deref()];
    arguments.overwriting.check(inputs.into_iter().flatten(), [output.as_path()])?;
    for (code, text) in &scenery.notes {
        let kind = if CHOICES.contains(code) { "note" } else { "warning" };
        say(format_args!("{kind}: {code}: {text}"));
    }
    let bytes = match kind(&output)? {
        None => {
            let mesh = mesh.as_ref().map(|mesh| mesh.as_named().bytes);
            engine::draw_poses(&scenery, mesh, &control).map_err(told)?
        }
        Some(format) => engine::draw_picture(&scenery, &mut read, format, &control).map_err(told)?.0,
    };
    StagedFiles::write_one(&output, &bytes)?;
    say(format_args!("wrote {}", output.display()));
    Ok(())
}

impl Arguments {
    /// What is drawn.
    fn scenery(
        &self,
        read: &mut dyn FnMut(&str) -> Result<Vec<u8>, Failure>,
        limits: &Limits,
        control: &Control,
    ) -> Result<Scenery, Exit> {
        let told = |failure: Failure| Exit::from_failure(&failure, "");
        if let (Some(folder), Some(motion)) = (&self.drawing, &self.motion) {
            let file = InputFile::read("motion", motion, limits)?;
            let motion = (file.as_named(), self.clip.as_deref());
            return engine::stage_drawing(&folder.display().to_string(), read, motion, limits, control).map_err(told);
        }
        let path = self.config.as_deref().unwrap_or(Path::new(""));
        let config = InputFile::read("config", path, limits)?;
        let name = path.display().to_string();
        let scene = NamedBytes { name: &name, bytes: config.as_named().bytes };
        let manner = match self.compat {
            Some(Compat::AnimatedDrawings) => Manner::Original,
            None => Manner::Steady,
        };
        engine::read_scenery(scene, read, manner, control).map_err(told)
    }

    /// Where the result goes.
    fn place(&self, scenery: &Scenery) -> Result<PathBuf, Exit> {
        let said = scenery.spec.controller.output_video_path.as_ref().map(PathBuf::from);
        self.output.clone().or(said).ok_or_else(|| {
            let message = "nothing says where the picture goes".to_owned();
            Exit::new(BAD_USAGE, message, "name the place with --output")
        })
    }
}

/// The kind of picture that an ending asks for; none for arrays.
fn kind(output: &Path) -> Result<Option<PictureFormat>, Exit> {
    let ending = output.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ending == "npz" {
        return Ok(None);
    }
    PictureFormat::of_ending(&ending, true).filter(|format| format.moves()).map(Some).ok_or_else(|| {
        let message = format!("output {}: drawings are not written in this format", output.display());
        Exit::new(BAD_USAGE, message, "end the name in .npz, .gif, .webp, .apng or .mp4")
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
