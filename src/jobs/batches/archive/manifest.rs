//! What an archive says of itself: of every item, what became of it, and which files are its.

use std::collections::BTreeMap;

use serde::Serialize;

use super::names::file_name_of;
use crate::{
    jobs::BatchSnapshot,
    store::{InputRole, JobFailure, JobRecord, ResultRecord},
};

/// The document `manifest.json`.
#[derive(Debug, Serialize)]
pub(super) struct Manifest {
    batch: String,
    state: &'static str,
    labels: BTreeMap<String, String>,
    items: Vec<Item>,
}

#[derive(Debug, Serialize)]
struct Item {
    item: u64,
    job: String,
    state: &'static str,
    source: String,
    target: String,
    labels: BTreeMap<String, String>,
    warnings_count: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    verdict_reason: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    coverage: Option<f64>,
    files: Vec<File>,
    #[serde(skip_serializing_if = "Option::is_none")]
    problem: Option<JobFailure>,
}

#[derive(Debug, Serialize)]
struct File {
    name: String,
    format: String,
    bytes: u64,
    sha256: String,
}

impl Manifest {
    /// Of a batch, without its items.
    pub(super) fn of(batch: &BatchSnapshot) -> Self {
        Self {
            batch: batch.record.id.to_string(),
            state: batch.state().name(),
            labels: batch.record.labels.clone(),
            items: Vec::new(),
        }
    }

    /// Adds an item with its files, each with its name in the archive.
    pub(super) fn add(&mut self, job: &JobRecord, files: &[(String, &ResultRecord)]) {
        let file = |(name, result): &(String, &ResultRecord)| File {
            name: name.clone(),
            format: result.format.clone(),
            bytes: result.bytes,
            sha256: result.sha256.clone(),
        };
        self.items.push(Item {
            item: job.batch.as_ref().map_or(0, |place| place.item),
            job: job.id.to_string(),
            state: job.state.name(),
            source: file_name_of(job, InputRole::Source).to_owned(),
            target: file_name_of(job, InputRole::Target).to_owned(),
            labels: job.request.labels.clone(),
            warnings_count: job.warnings,
            verdict: job.judgment.as_ref().map(|judgment| judgment.verdict.name()),
            verdict_reason: job.judgment.as_ref().map(|judgment| judgment.reason.clone()),
            coverage: job.judgment.as_ref().and_then(|judgment| judgment.coverage),
            files: files.iter().map(file).collect(),
            problem: job.failure.clone(),
        });
    }

    /// As text.
    pub(super) fn text(&self) -> Vec<u8> {
        serde_json::to_vec_pretty(self).unwrap_or_default()
    }
}
