//! The `inspect` subcommand: what files hold.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::{Value, json};

use crate::{
    engine::{self, Failure, Inspection},
    formats::{DRAWING_FILES, Limits, pack_files},
    model::Control,
};

use super::{
    exit::{Exit, INPUT_REFUSED, one_line, print, report, say, to_json},
    files::InputFile,
    limits::LimitArguments,
    manner::speaks_json,
    user_knowledge::RigPaths,
    watch::cancel_on_interrupt,
};

/// Arguments of `retargetd inspect`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The files to look at, or the folder of a drawing; '-' is standard input
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    rigs: RigPaths,
    #[command(flatten)]
    limits: LimitArguments,
}

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let limits = arguments.limits.limits;
    let knowledge = arguments.rigs.read(&limits)?;
    let control = Arc::new(Control::new());
    cancel_on_interrupt(&control);
    let look = |path: &PathBuf| {
        let file = if path.is_dir() { drawing_in(path, &limits)? } else { InputFile::read("file", path, &limits)? };
        engine::inspect_with(file.as_named(), &knowledge, &limits, &control)
            .map_err(|failure| Exit::from_failure(&failure, &format!("file {}", file.path.display())))
    };
    if let [path] = arguments.files.as_slice() {
        let inspection = look(path)?;
        return print(&if speaks_json() {
            to_json(&inspection)?
        } else {
            format!("{}\n", inspection.to_string().trim_end())
        });
    }
    inspect_all(&arguments.files, look)
}

/// The files of a drawing in a folder, as the archive that they could come in.
fn drawing_in(folder: &Path, limits: &Limits) -> Result<InputFile, Exit> {
    let [character, ..] = DRAWING_FILES;
    if !folder.join(character).is_file() {
        let message = format!("file {}: this is a folder without {character}", folder.display());
        return Err(Exit::new(INPUT_REFUSED, message, "name a file, or the folder of a drawing"));
    }
    let read = |name: &str| InputFile::read("file", &folder.join(name), limits);
    let files = DRAWING_FILES.map(|name| read(name).map(|file| (name, file)));
    let files = files.into_iter().collect::<Result<Vec<_>, _>>()?;
    let members = files.iter().map(|(name, file)| (*name, file.as_named().bytes));
    let failed = |error| Exit::from_failure(&Failure::from(error), &format!("file {}", folder.display()));
    Ok(InputFile::made(folder, pack_files(members).map_err(failed)?))
}

/// Looks at every file; one that cannot be read is told, and the others are looked at.
fn inspect_all(files: &[PathBuf], look: impl Fn(&PathBuf) -> Result<Inspection, Exit>) -> Result<(), Exit> {
    let (mut views, mut codes): (Vec<Value>, Vec<u8>) = (Vec::new(), Vec::new());
    for path in files {
        match look(path) {
            Ok(inspection) if speaks_json() => views.push(json!({"file": path, "inspection": inspection})),
            Ok(inspection) => print(&format!("== {}\n{}\n\n", path.display(), inspection.to_string().trim_end()))?,
            Err(exit) => {
                say(format_args!("failed: {}", one_line(&exit.message)));
                views.push(json!({"file": path, "error": exit.view()}));
                codes.push(exit.code);
            }
        }
    }
    report(|| json!({"files": views}))?;
    let Some(code) = codes.iter().copied().max() else { return Ok(()) };
    let message = format!("{} of {} files cannot be read", codes.len(), files.len());
    Err(Exit { is_reported: true, ..Exit::new(code, message, "the lines above say why") })
}
