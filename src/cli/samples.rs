//! The `samples` subcommand: a clip, a character and a drawing to try things with, made by code.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use serde_json::json;

use crate::samples;

use super::{
    exit::{Exit, FAILED, print, report},
    files::StagedFiles,
    manner::speaks_json,
};

/// Arguments of `retargetd samples`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// The folder to write to; created if missing
    #[arg(long, value_name = "DIR", default_value = ".")]
    output: PathBuf,
}

pub(super) fn run(arguments: &Arguments) -> ExitCode {
    match write(&arguments.output) {
        Ok(()) => ExitCode::SUCCESS,
        Err(exit) => exit.tell(),
    }
}

fn write(folder: &Path) -> Result<(), Exit> {
    std::fs::create_dir_all(folder).map_err(|error| {
        Exit::new(FAILED, format!("output {}: the folder cannot be made: {error}", folder.display()), "")
    })?;
    let files = [
        ("walk.glb", samples::walk_clip(), "a walk on a skeleton with Mixamo's joint names, T pose"),
        ("mannequin.glb", samples::mannequin(), "a skinned mannequin with Unreal 5 joint names, A pose"),
        (
            "drawing.zip",
            samples::drawing(),
            "a drawn child with the joints of Animated Drawings, to move with 'retargetd draw'",
        ),
    ];
    let mut staged = StagedFiles::default();
    let mut told = String::new();
    for (name, bytes, what) in files {
        let path = folder.join(name);
        staged.add(&path, &bytes)?;
        told.push_str(&format!("{}: {what}\n", path.display()));
    }
    staged.commit()?;
    if speaks_json() {
        let files = ["walk.glb", "mannequin.glb"].map(|name| folder.join(name));
        return report(|| json!({"files": files}));
    }
    print(&told)
}
