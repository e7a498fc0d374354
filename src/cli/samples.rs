//! The `samples` subcommand: a clip and a character to try things with, made by code.

use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use crate::samples;

use super::{
    exit::{Exit, FAILED, print},
    files::StagedFiles,
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
    ];
    let mut staged = StagedFiles::default();
    let mut told = String::new();
    for (name, bytes, what) in files {
        let path = folder.join(name);
        staged.add(&path, &bytes)?;
        told.push_str(&format!("{}: {what}\n", path.display()));
    }
    staged.commit()?;
    print(&told)
}
