//! What is asked for: the files, uploaded, and the words around them.

use std::path::PathBuf;

use serde_json::{Map, Value, json};

use super::{batch, remote::Remote};
use crate::{
    cli::{
        exit::{BAD_USAGE, Exit},
        files::InputFile,
        inputs::RestPaths,
    },
    engine,
    formats::{Format, Limits},
};

/// The arguments that ask for a new job.
pub(super) const ASKING: [&str; 9] =
    ["batch", "source", "target", "source_rest", "target_rest", "config", "preset", "priority", "labels"];

#[derive(Debug, clap::Args)]
pub(super) struct SubmissionArguments {
    /// The file with the animation
    #[arg(long, value_name = "FILE", required_unless_present_any = ["resume", "batch"])]
    source: Option<PathBuf>,
    /// Many animation files instead of one: a folder, or a text file with one path per line. In output names, {name} stands for
    /// the name of each
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["source"])]
    pub(super) batch: Option<PathBuf>,
    /// The file with the target character; not needed if the config has "task": "edit"
    #[arg(long, value_name = "FILE")]
    target: Option<PathBuf>,
    #[command(flatten)]
    rests: RestPaths,
    /// The retarget config (JSON or YAML), or a config of another tool; without it, everything is detected
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// A preset stored in the service, which the config extends
    #[arg(long, value_name = "NAME")]
    preset: Option<String>,
    /// Priority among your waiting jobs, from -100 to 100; higher runs first
    #[arg(long, value_name = "NUMBER", allow_negative_numbers = true)]
    priority: Option<i32>,
    /// A label of the job. May be repeated
    #[arg(long = "label", value_name = "NAME=TEXT", value_parser = label)]
    labels: Vec<(String, String)>,
}

fn label(text: &str) -> Result<(String, String), String> {
    let (name, value) = text.split_once('=').ok_or_else(|| "expected NAME=TEXT, such as shot=012".to_owned())?;
    Ok((name.to_owned(), value.to_owned()))
}

impl SubmissionArguments {
    /// Uploads the files and asks for the job, or for the batch; gives its id.
    pub(super) async fn submit(&self, remote: &Remote, formats: &[Format]) -> Result<String, Exit> {
        // Everything is read before anything is sent.
        let limits = Limits::default();
        let config = self.config(&limits)?;
        let parts = [
            ("source", &self.source),
            ("target", &self.target),
            ("source_rest", &self.rests.source_rest),
            ("target_rest", &self.rests.target_rest),
        ];
        let mut files = Vec::new();
        for (part, path) in parts {
            if let Some(path) = path {
                files.push((part, InputFile::read(part, path, &limits)?));
            }
        }
        let mut body = json!({
            "output": formats.iter().map(|format| format.info().name).collect::<Vec<_>>(),
            "priority": self.priority.unwrap_or(0),
            "labels": self.labels.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
        });
        for (part, file) in files {
            let asset = remote.upload(part, &file).await?;
            body[part] = json!({"asset": asset});
        }
        if let Some(config) = config {
            body["config"] = config;
        }
        if let Some(preset) = &self.preset {
            body["preset"] = json!(preset);
        }
        match &self.batch {
            Some(place) => batch::submit(remote, place, &body).await,
            None => remote.ask("/v1/jobs", &body).await,
        }
    }

    /// The config as JSON; what is wrong with it by itself is told before anything is sent.
    fn config(&self, limits: &Limits) -> Result<Option<Value>, Exit> {
        let Some(path) = &self.config else { return Ok(None) };
        let file = InputFile::read("config", path, limits)?;
        let subject = format!("config {}", path.display());
        let checked =
            engine::check_config(file.as_named()).map_err(|failure| Exit::from_failure(&failure, &subject))?;
        // As it was written, where it is one of ours: what it does not say is the preset's to say.
        let own = engine::merge_config(&Value::Object(Map::new()), Some(file.as_named())).ok();
        let own = own.and_then(|text| serde_json::from_str(&text).ok());
        if own.is_none() && self.preset.is_some() {
            let message = format!("{subject}: a config of another tool is complete");
            return Err(Exit::new(BAD_USAGE, message, "leave --preset out"));
        }
        Ok(Some(own.unwrap_or(checked)))
    }
}
