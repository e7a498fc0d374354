//! The two rigs of a command line: their files, read, and what a failure is about in the user's words.

use std::path::{Path, PathBuf};

use crate::{
    engine::{Failure, Inputs, Knowledge, NamedBytes},
    formats::{Format, Limits},
};

use super::{
    exit::Exit,
    files::InputFile,
    user_knowledge::{PresetChoice, RigPaths},
};

/// What every subcommand about a source and a target is given.
#[derive(Debug, clap::Args)]
pub(super) struct InputPaths {
    /// The file with the animation; '-' is standard input
    #[arg(long, value_name = "FILE")]
    source: PathBuf,
    #[command(flatten)]
    onto: OntoPaths,
}

/// Everything but the source.
#[derive(Debug, clap::Args)]
pub(super) struct OntoPaths {
    /// The file with the character that the animation goes onto
    #[arg(long, value_name = "FILE")]
    target: PathBuf,
    #[command(flatten)]
    rests: RestPaths,
    /// The retarget config (JSON or YAML) with what is already known; without it, everything is detected
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    #[command(flatten)]
    preset: PresetChoice,
    #[command(flatten)]
    rigs: RigPaths,
}

impl InputPaths {
    /// Reads the files, and what is taught beside them.
    pub(super) fn read(&self, limits: &Limits) -> Result<(InputFiles, Knowledge), Exit> {
        self.onto.read(&self.source, limits)
    }
}

impl OntoPaths {
    /// Every file that is read, with that source.
    pub(super) fn paths_with<'p>(&'p self, source: &'p Path) -> impl Iterator<Item = &'p Path> {
        let rests = [self.rests.source_rest.as_ref(), self.rests.target_rest.as_ref(), self.config.as_ref()];
        let others = [Some(&self.target)].into_iter().chain(rests).flatten().map(PathBuf::as_path);
        std::iter::once(source).chain(others)
    }

    /// Reads the files, and what is taught beside them.
    pub(super) fn read(&self, source: &Path, limits: &Limits) -> Result<(InputFiles, Knowledge), Exit> {
        Ok((self.read_with(|| InputFile::read("source", source, limits), limits)?, self.knowledge(limits)?))
    }

    /// Reads all files but a source that is read otherwise.
    pub(super) fn read_others(&self, source: &Path, limits: &Limits) -> Result<InputFiles, Exit> {
        self.read_with(|| Ok(InputFile::made(source, Vec::new())), limits)
    }

    fn read_with(&self, source: impl FnOnce() -> Result<InputFile, Exit>, limits: &Limits) -> Result<InputFiles, Exit> {
        let config = (self.config.as_deref(), &self.preset);
        InputFiles::read(source, &self.target, &self.rests, config, limits)
    }

    /// What is taught beside the files.
    pub(super) fn knowledge(&self, limits: &Limits) -> Result<Knowledge, Exit> {
        self.rigs.read(limits)
    }
}

/// Where rest poses are that the files themselves do not hold.
#[derive(Debug, clap::Args)]
pub(super) struct RestPaths {
    /// The source rig in its rest pose, if the source file does not contain it
    #[arg(long, value_name = "FILE")]
    pub(super) source_rest: Option<PathBuf>,
    /// The target rig in its rest pose, if the target file does not contain it
    #[arg(long, value_name = "FILE")]
    pub(super) target_rest: Option<PathBuf>,
}

/// The files, read.
pub(super) struct InputFiles {
    source: InputFile,
    target: InputFile,
    source_rest: Option<InputFile>,
    target_rest: Option<InputFile>,
    config: Option<InputFile>,
    /// The config laid over a preset.
    merged: Option<String>,
}

impl InputFiles {
    pub(super) fn read(
        source: impl FnOnce() -> Result<InputFile, Exit>,
        target: &Path,
        rests: &RestPaths,
        (config, preset): (Option<&Path>, &PresetChoice),
        limits: &Limits,
    ) -> Result<Self, Exit> {
        let optional =
            |part: &str, path: Option<&Path>| path.map(|path| InputFile::read(part, path, limits)).transpose();
        let config = optional("config", config)?;
        Ok(Self {
            merged: preset.under(config.as_ref(), limits)?,
            config,
            source: source()?,
            target: InputFile::read("target", target, limits)?,
            source_rest: optional("source_rest", rests.source_rest.as_deref())?,
            target_rest: optional("target_rest", rests.target_rest.as_deref())?,
        })
    }

    pub(super) fn inputs<'a>(&'a self, formats: &'a [Format]) -> Inputs<'a> {
        Inputs {
            source: self.source.as_named(),
            target: self.target.as_named(),
            source_rest: self.source_rest.as_ref().map(InputFile::as_named),
            target_rest: self.target_rest.as_ref().map(InputFile::as_named),
            config: self.merged.as_ref().map_or_else(
                || self.config.as_ref().map(InputFile::as_named),
                |merged| Some(NamedBytes { name: "config.json", bytes: merged.as_bytes() }),
            ),
            formats,
        }
    }

    /// A failure of the engine, told with the name of the file that it is about.
    pub(super) fn exit(&self, failure: &Failure) -> Exit {
        let file = match failure.part {
            "source" => Some(&self.source),
            "target" => Some(&self.target),
            "source_rest" => self.source_rest.as_ref(),
            "target_rest" => self.target_rest.as_ref(),
            "config" => self.config.as_ref(),
            _ => None,
        };
        let subject =
            file.map_or_else(|| failure.part.to_owned(), |file| format!("{} {}", failure.part, file.path.display()));
        Exit::from_failure(failure, &subject)
    }
}
