//! The JSON that asks for a job.

use std::collections::BTreeMap;

use serde::Deserialize;
use utoipa::ToSchema;

use crate::{
    config::Settings,
    engine::{Format, nearest},
    http::{code::Code, problem::Problem},
    jobs::{AssetId, ConfigDocument, InputRole, NewJob, WebhookId},
};

/// Asks for a job on files that have been uploaded.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewJob)]
pub(in crate::http) struct NewJobBody {
    /// The file with the animation.
    source: InputBody,
    /// The file with the character that it goes onto; a drawing is made to move. Left out only where the config has `"task": "edit"`.
    target: Option<InputBody>,
    /// The source rig in its rest pose, where the source file does not hold it.
    source_rest: Option<InputBody>,
    /// The target rig in its rest pose, where the target file does not hold it.
    target_rest: Option<InputBody>,
    /// What goes beside a drawing, as a zip archive: `mvc.yaml`, `motion.yaml`, `retarget.yaml`, a picture called `background`.
    scene: Option<InputBody>,
    /// The retarget spec; `/v1/schemas/retarget-spec` is its schema. Left out, everything is found out.
    #[schema(value_type = Option<Object>)]
    config: Option<serde_json::Map<String, serde_json::Value>>,
    /// Names of the formats to make, as `/v1/formats` lists them. Left out, the config says, else `glb`.
    #[serde(default)]
    #[schema(example = json!(["glb", "poses_npz"]))]
    output: Vec<String>,
    /// A preset that the config is laid over, as `GET /v1/presets` lists them: objects are merged member by member, everything
    /// else (lists too) is taken from the config where it says something (RFC 7396).
    #[schema(example = "plain_fk")]
    preset: Option<String>,
    /// Among your waiting jobs, the greater goes first: from -100 to 100.
    #[serde(default)]
    #[schema(minimum = -100, maximum = 100)]
    priority: i32,
    /// Words of your own, given back with the job.
    #[serde(default)]
    labels: BTreeMap<String, String>,
    /// The id of a webhook of yours that is told of its end, whatever that listens to.
    #[schema(example = "whk_01j9z3k8m0q4r6t8v0x2y4a6c8")]
    webhook: Option<String>,
    /// Checks everything that can be checked without running it, and answers with what the job would do. Nothing is asked for.
    #[serde(default)]
    pub(super) validate_only: bool,
}

/// A file of a job.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewJobInput)]
pub(in crate::http) struct InputBody {
    /// The id of an asset. Three ids name the samples that every caller has: `ast_00000000000000000000000001` a walk, `…02` the mannequin,
    /// `…03` the drawing; the first use of one makes it an asset of the caller's.
    #[schema(example = "ast_00000000000000000000000001")]
    pub(super) asset: String,
}

/// Two rigs, and what is known already about how they belong together.
#[derive(Debug, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
#[schema(as = NewMappingSuggestion)]
pub(in crate::http) struct SuggestionBody {
    /// The file with the animation; it may hold none.
    source: InputBody,
    /// The file with the character that it goes onto.
    target: InputBody,
    /// The source rig in its rest pose, where the source file does not hold it.
    source_rest: Option<InputBody>,
    /// The target rig in its rest pose, where the target file does not hold it.
    target_rest: Option<InputBody>,
    /// What is known already, as in a retarget spec; the rest is found out.
    #[schema(value_type = Option<Object>)]
    config: Option<serde_json::Map<String, serde_json::Value>>,
    /// A preset that the config is laid over.
    preset: Option<String>,
}

impl SuggestionBody {
    /// The files and the config, as a job has them.
    pub(super) fn read(self) -> Result<NewJob, Problem> {
        let inputs = read_inputs([Some(self.source), Some(self.target), self.source_rest, self.target_rest, None])?;
        Ok(NewJob { inputs, config: self.config.map(config_document), preset: self.preset, ..NewJob::default() })
    }
}

impl NewJobBody {
    /// What is asked for.
    ///
    /// # Errors
    /// When an id, a format or a label cannot be used.
    pub(in crate::http) fn read(self, settings: &Settings) -> Result<NewJob, Problem> {
        let inputs = read_inputs([Some(self.source), self.target, self.source_rest, self.target_rest, self.scene])?;
        let asks_for_edit = self.config.as_ref().is_some_and(|config| config.get("task") == Some(&"edit".into()));
        if !inputs.contains_key(&InputRole::Target) && !asks_for_edit {
            return Err(no_target());
        }
        let config = self.config.map(config_document);
        let formats = read_formats(&self.output, settings.max_outputs_per_job)?;
        if !(-100..=100).contains(&self.priority) {
            let detail = format!("a priority is from -100 to 100, not {}", self.priority);
            return Err(Problem::new(Code::InvalidValue, detail)
                .at("/priority", Vec::new())
                .with_hint("0 is usual; of your jobs that wait, those with more run first"));
        }
        let labels = check_labels(self.labels, settings)?;
        let webhook = self.webhook.as_deref().map(webhook_id).transpose()?;
        let (preset, priority) = (self.preset, self.priority);
        Ok(NewJob { inputs, config, formats, preset, labels, priority, webhook, ..NewJob::default() })
    }
}

fn no_target() -> Problem {
    Problem::new(Code::InvalidValue, "a retarget needs a target")
        .at("/target", Vec::new())
        .with_hint("name the asset of a character; only a config with {\"task\": \"edit\"} needs none")
}

/// The ids of files by what they are to be.
///
/// # Errors
/// When an id is none.
pub(super) fn read_inputs(given: [Option<InputBody>; 5]) -> Result<BTreeMap<InputRole, AssetId>, Problem> {
    let mut inputs = BTreeMap::new();
    for (role, input) in InputRole::ALL.into_iter().zip(given) {
        if let Some(input) = input {
            inputs.insert(role, asset_id(role, &input.asset)?);
        }
    }
    Ok(inputs)
}

/// A config that came inside a JSON body.
pub(super) fn config_document(config: serde_json::Map<String, serde_json::Value>) -> ConfigDocument {
    ConfigDocument { file_name: "config.json".to_owned(), text: serde_json::Value::Object(config).to_string().into() }
}

fn webhook_id(text: &str) -> Result<WebhookId, Problem> {
    WebhookId::parse(text).map_err(|error| {
        Problem::new(Code::InvalidValue, error.to_string())
            .at("/webhook", Vec::new())
            .with_hint("GET /v1/webhooks lists those that there are; POST /v1/webhooks makes one")
    })
}

fn asset_id(role: InputRole, text: &str) -> Result<AssetId, Problem> {
    AssetId::parse(text).map_err(|error| {
        Problem::new(Code::InvalidValue, error.to_string())
            .at(format!("/{}/asset", role.name()), Vec::new())
            .with_hint("POST /v1/assets uploads a file and gives its id; GET /v1/assets lists those that there are")
    })
}

fn read_formats(names: &[String], most: u64) -> Result<Vec<Format>, Problem> {
    if names.len() as u64 > most {
        let detail = format!("{} formats are asked for; the limit 'outputs_per_job' is {most}", names.len());
        return Err(Problem::new(Code::InvalidValue, detail)
            .about_limit("outputs_per_job", most, names.len() as u64)
            .at("/output", Vec::new()));
    }
    let read = |(place, name): (usize, &String)| {
        let format = Format::from_name(name).or_else(|| Format::from_file_name(&format!(".{name}")));
        let seen_before = names[..place].contains(name);
        format.filter(|format| format.info().writes && !seen_before).ok_or_else(|| {
            let shown: String = name.chars().take(64).collect();
            let detail = match format {
                _ if seen_before => format!("'{shown}' is asked for twice"),
                Some(format) if format.info().feature.is_some() => format.info().why_unwritten(),
                _ => format!("'{shown}' is not a format that can be written"),
            };
            let similar = similar_formats(name);
            let hint = match similar.as_slice() {
                [] => "GET /v1/formats lists those that there are".to_owned(),
                similar => format!("did you mean {}? GET /v1/formats lists those that there are", similar.join(" or ")),
            };
            Problem::new(Code::InvalidValue, detail).at(format!("/output/{place}"), similar).with_hint(hint)
        })
    };
    names.iter().enumerate().map(read).collect()
}

fn similar_formats(name: &str) -> Vec<String> {
    let writable = Format::ALL.into_iter().map(Format::info).filter(|info| info.writes && info.name != name);
    nearest(name, writable.map(|info| info.name))
}

pub(super) fn check_labels(
    labels: BTreeMap<String, String>,
    settings: &Settings,
) -> Result<BTreeMap<String, String>, Problem> {
    let (most, most_bytes) = (settings.max_labels, settings.max_label_bytes.0);
    let count = labels.len() as u64;
    if count > most {
        let detail = format!("there are {count} labels; the limit 'labels' is {most}");
        return Err(Problem::new(Code::InvalidValue, detail)
            .about_limit("labels", most, count)
            .at("/labels", Vec::new()));
    }
    match labels.iter().find(|(name, value)| name.len().max(value.len()) as u64 > most_bytes) {
        Some((name, value)) => {
            let actual = name.len().max(value.len()) as u64;
            let detail = format!("a label is longer than the limit 'label_bytes' of {most_bytes} allows");
            Err(Problem::new(Code::InvalidValue, detail)
                .about_limit("label_bytes", most_bytes, actual)
                .at("/labels", Vec::new()))
        }
        None => Ok(labels),
    }
}
