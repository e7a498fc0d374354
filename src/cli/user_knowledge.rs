//! What a command line teaches the engine: rig templates and a preset, as files. The service keeps them under names instead.

use std::path::{Path, PathBuf};

use crate::{
    engine::{self, FailureCode, Knowledge, NamedBytes},
    formats::Limits,
};

use super::{
    exit::{Exit, INPUT_REFUSED},
    files::InputFile,
};

/// Rig templates of one's own.
#[derive(Debug, clap::Args)]
pub(super) struct RigPaths {
    /// A rig template of your own (JSON or YAML), tried before the built-in ones. May be repeated
    #[arg(long = "rig", value_name = "FILE")]
    rigs: Vec<PathBuf>,
}

impl RigPaths {
    /// Reads them all.
    pub(super) fn read(&self, limits: &Limits) -> Result<Knowledge, Exit> {
        let mut texts = Vec::with_capacity(self.rigs.len());
        for path in &self.rigs {
            let file = InputFile::read("rig", path, limits)?;
            let text = std::str::from_utf8(file.as_named().bytes).map(str::to_owned);
            let text = text.map_err(|_| not_text("rig", path))?;
            // One by one, so that what is wrong is told with the file that it is in.
            Knowledge::read([text.as_str()])
                .map_err(|failure| Exit::from_failure(&failure, &format!("rig {}", path.display())))?;
            texts.push(text);
        }
        Knowledge::read(texts.iter().map(String::as_str)).map_err(|failure| Exit::from_failure(&failure, "rig"))
    }
}

/// A preset under the config.
#[derive(Debug, clap::Args)]
pub(super) struct PresetChoice {
    /// A preset that the config extends: the name of a built-in one, or a file
    #[arg(long, value_name = "NAME|FILE")]
    preset: Option<String>,
}

impl PresetChoice {
    /// The config with the preset under it; nothing where no preset is asked for.
    pub(super) fn under(&self, config: Option<&InputFile>, limits: &Limits) -> Result<Option<String>, Exit> {
        let Some(name) = &self.preset else { return Ok(None) };
        let presets = engine::built_in_presets();
        let told = |failure: &engine::Failure, subject: &str| Exit::from_failure(failure, subject);
        let document = match presets.iter().find(|(known, _)| known == name) {
            Some((_, document)) => document.clone(),
            None if Path::new(name).exists() => {
                let file = InputFile::read("preset", Path::new(name), limits)?;
                let text = engine::merge_config(&serde_json::json!({}), Some(file.as_named()));
                let text = text.map_err(|failure| told(&failure, &format!("preset {name}")))?;
                let checked = engine::check_config(NamedBytes { name, bytes: text.as_bytes() });
                checked.map_err(|failure| told(&failure, &format!("preset {name}")))?;
                serde_json::from_str(&text).unwrap_or_default()
            }
            None => {
                let known: Vec<&str> = presets.iter().map(|(name, _)| name.as_str()).collect();
                let message = format!("preset {name}: there is no such file, and no built-in preset of that name");
                return Err(Exit::new(INPUT_REFUSED, message, format!("built-in presets are {}", known.join(", "))));
            }
        };
        let merged = engine::merge_config(&document, config.map(InputFile::as_named));
        merged.map(Some).map_err(|failure| {
            let subject = config.map_or_else(|| "config".to_owned(), |file| format!("config {}", file.path.display()));
            let subject = if failure.code == FailureCode::Internal { String::new() } else { subject };
            told(&failure, &subject)
        })
    }
}

fn not_text(part: &str, path: &Path) -> Exit {
    let message = format!("{part} {}: the file is not UTF-8 text", path.display());
    Exit::new(INPUT_REFUSED, message, "send JSON or YAML")
}
