//! Results that are there already: a job that computes what another one of the same principal has computed is given that.
//!
//! A job is a function of its input files, its config and the program, and the key is a digest over all of them. It is made by the process
//! that runs the job, so processes of different builds do not take one another's results. Never looked up across principals.

use std::{sync::OnceLock, time::UNIX_EPOCH};

use serde_json::json;

use super::{JobEvent, Jobs, Refusal, library, result_names, running::RunningJob};
use crate::store::{CachedResults, FinishedJob, JobRecord, JobRequest, JobState, ResultId, ResultRecord};

impl Jobs {
    /// The key of what a job computes; nothing where results are not to be taken from others.
    pub(super) fn cache_key(&self, request: &JobRequest) -> Option<String> {
        self.0.settings.result_cache.0.then(|| key_of(request))
    }

    /// What another job gave that computed the same. That it cannot be looked up is no reason not to run the job.
    pub(super) async fn cached(&self, record: &JobRecord) -> Option<CachedResults> {
        if record.request.skip_cache {
            return None;
        }
        let key = self.cache_key(&record.request)?;
        let found = self.0.store.records().cached_results(&record.principal, &key, self.0.clock.now()).await;
        found.unwrap_or_else(|error| {
            tracing::warn!(job_id = %record.id, %error, "it could not be looked up whether the results are there already");
            None
        })
    }

    /// Ends a job with the results of another one. Gives `false` when they have gone in the meantime.
    pub(super) async fn succeed_again(
        &self,
        record: &JobRecord,
        running: &RunningJob,
        found: &CachedResults,
    ) -> Result<bool, Refusal> {
        let digests: Vec<&str> = found.results.iter().map(|result| result.sha256.as_str()).collect();
        let _held = self.0.store.hold_blobs(&digests).await?;
        // Looked up again, since they could have been removed until now.
        if self.cached(record).await.as_ref() != Some(found) {
            return Ok(false);
        }
        let (created_at, expires_at) = (self.0.clock.now(), self.0.clock.after(self.0.settings.result_retention.0));
        // The other job may have been called otherwise.
        let mut taken = Vec::new();
        let mut own = |result: &ResultRecord| ResultRecord {
            file_name: result_names::name_of(&record.request, &result.file_name, &mut taken),
            id: ResultId::new(),
            job_id: record.id.clone(),
            created_at,
            expires_at,
            ..result.clone()
        };
        let end = FinishedJob {
            report: found.report.clone(),
            resolved_spec: found.resolved_spec.clone(),
            warnings: found.warnings,
            judgment: found.judgment.clone(),
            results: found.results.iter().map(&mut own).collect(),
            cache_key: self.cache_key(&record.request),
            cached_from: Some(found.job.clone()),
            ..self.ending(JobState::Succeeded, None)
        };
        self.write_end(record, running, JobEvent::Succeed, end).await?;
        Ok(true)
    }
}

fn key_of(request: &JobRequest) -> String {
    let inputs: Vec<_> =
        request.inputs.iter().map(|(role, input)| (role.name(), &input.sha256, &input.file_name)).collect();
    let config = request.config.as_ref().map(|config| (&config.file_name, &*config.text));
    let rigs: Vec<_> = request.rigs.iter().map(|rig| (&rig.name, rig.version)).collect();
    library::digest(&json!([build(), request.task, inputs, config, request.formats, rigs]).to_string())
}

/// Which program runs: the version, and what tells builds of one version apart.
fn build() -> &'static str {
    static BUILD: OnceLock<String> = OnceLock::new();
    BUILD.get_or_init(|| {
        let file = std::env::current_exe().and_then(std::fs::metadata);
        let facts = file.and_then(|file| Ok((file.len(), file.modified()?)));
        let facts = facts.map(|(bytes, time)| (bytes, time.duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos()));
        format!("{} {:?}", env!("CARGO_PKG_VERSION"), facts.ok())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::{AssetId, ConfigDocument, InputRole, JobInput, JobTask, VersionedName};

    fn request() -> JobRequest {
        let input = |sha256: &str| JobInput {
            asset: AssetId::new(),
            sha256: sha256.to_owned(),
            file_name: "walk.bvh".to_owned(),
        };
        JobRequest {
            task: JobTask::Retarget,
            inputs: [(InputRole::Source, input("aa")), (InputRole::Target, input("bb"))].into(),
            config: None,
            formats: vec!["glb".to_owned()],
            labels: [("shot".to_owned(), "012".to_owned())].into(),
            preset: None,
            rigs: Vec::new(),
            result_name: None,
            skip_cache: false,
            webhook: None,
        }
    }

    #[test]
    fn a_key_is_of_what_is_computed_and_of_nothing_else() {
        let first = request();
        let same = JobRequest { labels: Default::default(), skip_cache: true, ..request() };
        assert_eq!(key_of(&first), key_of(&same), "assets and labels do not matter");
        let config = Some(ConfigDocument { file_name: "config.json".to_owned(), text: "{}".into() });
        let with = |files: [(InputRole, &JobInput); 2]| {
            let given = files.map(|(role, input)| (role, input.clone()));
            let inputs = request().inputs.into_iter().chain(given).collect();
            JobRequest { inputs, ..request() }
        };
        let (source, target) = (&first.inputs[&InputRole::Source], &first.inputs[&InputRole::Target]);
        let others = [
            with([(InputRole::Source, target), (InputRole::Target, source)]),
            JobRequest { task: JobTask::Pose { to: Some("a".to_owned()) }, ..request() },
            JobRequest { task: JobTask::Pose { to: Some("t".to_owned()) }, ..request() },
            JobRequest { config, ..request() },
            JobRequest { formats: vec!["bvh".to_owned()], ..request() },
            with([(InputRole::SourceRest, source), (InputRole::Source, source)]),
            JobRequest { rigs: vec![VersionedName { name: "hero".to_owned(), version: 2 }], ..request() },
        ];
        for other in others {
            assert_ne!(key_of(&first), key_of(&other), "{other:?} computes something else");
        }
    }
}
