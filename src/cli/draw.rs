//! The `draw` subcommand: a scene of drawn characters to what they do.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use clap::ValueEnum;

use crate::{
    engine::{self, Failure, FailureCode, Limits, NamedBytes, PictureFormat, Scenery},
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
    /// The config of the scene, as *Animated Drawings* reads it
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Whose numbers come out
    #[arg(long, value_enum)]
    compat: Compat,
    /// Where the result goes; .npz: the poses as arrays; .gif, .webp, .apng: a moving picture. Without it, where the scene says
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// An archive with mesh_rest_vertices and mesh_triangles; it is deformed with the first character
    #[arg(long, value_name = "FILE")]
    mesh: Option<PathBuf>,
    #[command(flatten)]
    overwriting: Overwriting,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Compat {
    /// Those of the program, with all that it does otherwise than one would
    #[value(name = "animated_drawings")]
    AnimatedDrawings,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match draw(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn draw(arguments: &Arguments) -> Result<(), Exit> {
    let Compat::AnimatedDrawings = arguments.compat;
    let limits = Limits::default();
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let config = InputFile::read("config", &arguments.config, &limits)?;
    let mesh = arguments.mesh.as_deref().map(|path| InputFile::read("mesh", path, &limits)).transpose()?;
    let name = arguments.config.display().to_string();
    let scene = NamedBytes { name: &name, bytes: config.as_named().bytes };
    let mut read = |file: &str| read_named(file, &arguments.config, &limits);
    let told = |failure: Failure| Exit::from_failure(&failure, "");
    let scenery = engine::read_scenery(scene, &mut read, &control).map_err(told)?;
    let output = arguments.place(&scenery)?;
    check_place(&output)?;
    let inputs = [Some(arguments.config.as_path()), arguments.mesh.as_deref()];
    arguments.overwriting.check(inputs.into_iter().flatten(), [output.as_path()])?;
    for (code, text) in &scenery.notes {
        say(format_args!("warning: {code}: {text}"));
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
    /// Where the result goes.
    fn place(&self, scenery: &Scenery) -> Result<PathBuf, Exit> {
        let said = scenery.spec.controller.output_video_path.as_ref().map(PathBuf::from);
        self.output.clone().or(said).ok_or_else(|| {
            let message = format!("config {}: the scene does not say where its picture goes", self.config.display());
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
        Exit::new(BAD_USAGE, message, "end the name in .npz, .gif, .webp or .apng")
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
