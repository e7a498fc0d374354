//! The `samples` subcommand: a clip, a character and a drawing to try things with, made by code.

use std::path::PathBuf;

use serde_json::json;

use crate::samples::Sample;

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

pub(super) fn run(arguments: &Arguments) -> Result<(), Exit> {
    let folder = &arguments.output;
    std::fs::create_dir_all(folder).map_err(|error| {
        Exit::new(FAILED, format!("output {}: the folder cannot be made: {error}", folder.display()), "")
    })?;
    let mut staged = StagedFiles::default();
    let mut told = String::new();
    for sample in Sample::ALL {
        let path = folder.join(sample.name);
        staged.add(&path, &sample.bytes())?;
        told.push_str(&format!("{}: {}\n", path.display(), sample.about));
    }
    staged.commit()?;
    if speaks_json() {
        let files = Sample::ALL.map(|sample| folder.join(sample.name));
        return report(|| json!({"files": files}));
    }
    print(&told)
}
