//! The `draw` subcommand: drawn characters, as the configs of Animated Drawings say.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
    sync::Arc,
};

use clap::ValueEnum;

use crate::{
    engine::{self, CharacterFiles, DrawnCharacter, WarningView},
    formats::Limits,
    model::Control,
};

use super::{
    exit::{BAD_USAGE, Exit, INPUT_REFUSED, say},
    files::{InputFile, StagedFiles, check_place},
    outputs::Overwriting,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd draw`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The scene: which characters do what (the YAML with `scene`, `view` and `controller`)
    #[arg(long, value_name = "FILE")]
    config: PathBuf,
    /// Whose numbers are wanted
    #[arg(long, value_enum)]
    compat: Compat,
    /// Where the result goes: .npz, for each frame angles, joints and roots
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    overwriting: Overwriting,
}

/// Whose numbers are wanted.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Compat {
    /// Those of Animated Drawings, with what is wrong in them
    #[value(name = "animated_drawings")]
    AnimatedDrawings,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match draw(arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

/// The files of one character, read.
struct Files {
    character: InputFile,
    motion: InputFile,
    bvh: InputFile,
    retarget: InputFile,
}

fn draw(arguments: &Arguments) -> Result<(), Exit> {
    let Compat::AnimatedDrawings = arguments.compat;
    let limits = Limits::default();
    let output = &arguments.output;
    check_place(output)?;
    if output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("npz")) {
        let message = format!("output {}: drawings are written as arrays only", output.display());
        return Err(Exit::new(BAD_USAGE, message, "end the name in .npz"));
    }
    let scene = InputFile::read("config", &arguments.config, &limits)?;
    let refused = |failure: &engine::Failure| Exit::from_failure(failure, &format!("config {}", scene.path.display()));
    let (characters, not_used) = engine::characters_of_scene(scene.as_named()).map_err(|failure| refused(&failure))?;
    for field in not_used {
        say(format_args!("warning: not_used: {field} has no effect here"));
    }
    let read = |files: &CharacterFiles| read_files(files, &arguments.config, &limits);
    let files = characters.iter().map(read).collect::<Result<Vec<Files>, Exit>>()?;
    let inputs = files.iter().flat_map(|files| [&files.character, &files.motion, &files.bvh, &files.retarget]);
    arguments.overwriting.check(inputs.map(|file| file.path.as_path()), [output.as_path()])?;
    let characters: Vec<DrawnCharacter<'_>> = files
        .iter()
        .map(|files| DrawnCharacter {
            character: files.character.as_named(),
            motion: files.motion.as_named(),
            bvh: files.bvh.as_named(),
            retarget: files.retarget.as_named(),
        })
        .collect();
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let drawn = engine::draw_poses(&characters, &limits, &control).map_err(|failure| refused(&failure))?;
    for WarningView { code, detail, .. } in &drawn.warnings {
        say(format_args!("warning: {code}: {detail}"));
    }
    StagedFiles::write_one(output, &drawn.bytes)?;
    let count = characters.len();
    let of_characters = if count == 1 { "1 character".to_owned() } else { format!("{count} characters") };
    say(format_args!("wrote {}: {of_characters}, {} frames", output.display(), drawn.frames));
    Ok(())
}

fn read_files(files: &CharacterFiles, scene: &Path, limits: &Limits) -> Result<Files, Exit> {
    let read = |part: &str, name: &str, from: &Path| InputFile::read(part, &found(part, name, from)?, limits);
    let character = read("character_cfg", &files.character_cfg, scene)?;
    let motion = read("motion_cfg", &files.motion_cfg, scene)?;
    let retarget = read("retarget_cfg", &files.retarget_cfg, scene)?;
    let bvh = engine::path_of_motion(motion.as_named())
        .map_err(|failure| Exit::from_failure(&failure, &format!("motion_cfg {}", motion.path.display())))?;
    let bvh = read("filepath", &bvh, &motion.path)?;
    Ok(Files { character, motion, bvh, retarget })
}

/// Where the file is that another one names: as it stands from the working directory, else from the folder of the file that names it or one
/// above that.
fn found(part: &str, name: &str, from: &Path) -> Result<PathBuf, Exit> {
    let named = Path::new(name);
    if named.exists() {
        return Ok(named.to_owned());
    }
    let from = from.canonicalize().unwrap_or_else(|_| from.to_owned());
    let beside = from.ancestors().skip(1).map(|folder| folder.join(named)).find(|path| path.exists());
    beside.ok_or_else(|| {
        let message = format!("{part} {name}: there is no such file here, nor beside {} or above it", from.display());
        Exit::new(INPUT_REFUSED, message, "run it in the folder that the paths of its files begin in")
    })
}
