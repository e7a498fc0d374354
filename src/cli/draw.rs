//! The `draw` subcommand: a scene of drawn characters to what they do.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use clap::ValueEnum;

use crate::{
    engine::{self, Failure, FailureCode, Limits, NamedBytes},
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
    /// Where the result goes; .npz: the poses as arrays
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
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
    check_place(&arguments.output)?;
    let inputs = [Some(arguments.config.as_path()), arguments.mesh.as_deref()];
    arguments.overwriting.check(inputs.into_iter().flatten(), [arguments.output.as_path()])?;
    let ending = arguments.output.extension().map(|ending| ending.to_string_lossy().to_lowercase()).unwrap_or_default();
    if ending != "npz" {
        let message = format!("output {}: drawings are not written in this format", arguments.output.display());
        return Err(Exit::new(BAD_USAGE, message, "end the name in .npz"));
    }
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let config = InputFile::read("config", &arguments.config, &limits)?;
    let mesh = arguments.mesh.as_deref().map(|path| InputFile::read("mesh", path, &limits)).transpose()?;
    let name = arguments.config.display().to_string();
    let scene = NamedBytes { name: &name, bytes: config.as_named().bytes };
    let mut read = |file: &str| read_named(file, &arguments.config, &limits);
    let told = |failure: Failure| Exit::from_failure(&failure, "");
    let scenery = engine::read_scenery(scene, &mut read, &control).map_err(told)?;
    for (code, text) in &scenery.notes {
        say(format_args!("warning: {code}: {text}"));
    }
    let mesh = mesh.as_ref().map(|mesh| mesh.as_named().bytes);
    let bytes = engine::draw_poses(&scenery, mesh, &control).map_err(told)?;
    StagedFiles::write_one(&arguments.output, &bytes)?;
    say(format_args!("wrote {}", arguments.output.display()));
    Ok(())
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
