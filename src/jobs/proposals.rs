//! What a retarget would do, without a job: for who maps rigs or edits configs, and waits for the answer.

use super::{Assets, Engine, NewJob, Refusal};
use crate::{
    engine::{Control, Limits, NamedBytes, Question},
    store::{ConfigDocument, JobRequest, Principal},
};

impl Assets {
    /// What a job with these inputs would do, as a JSON object, and the inputs that were found.
    ///
    /// # Errors
    /// When an input is not there, or as [`crate::engine::propose`].
    pub async fn propose(&self, owner: &Principal, new: NewJob) -> Result<(JobRequest, serde_json::Value), Refusal> {
        let request = self.jobs.resolve(owner, new).await?.request;
        let files = self.jobs.read_inputs(&request).await?;
        let knowledge = self.jobs.knowledge(owner, &request.rigs).await?;
        let work = request.clone();
        let proposal = self
            .look("propose", "looking into the files", move |engine, limits, control| {
                engine.propose(&files.inputs(&work, &[]), &knowledge, limits, control)
            })
            .await?;
        Ok((request, proposal))
    }

    /// Why a joint of what a retarget of these files gives is turned as it is at a frame, as a JSON object.
    ///
    /// # Errors
    /// When a file is not there, or as [`crate::engine::explain`].
    pub async fn explain(
        &self,
        owner: &Principal,
        new: NewJob,
        frame: usize,
        joint: String,
    ) -> Result<serde_json::Value, Refusal> {
        let request = self.jobs.resolve(owner, new).await?.request;
        let files = self.jobs.read_inputs(&request).await?;
        let knowledge = self.jobs.knowledge(owner, &request.rigs).await?;
        self.look("explain", "explaining the joint", move |engine, limits, control| {
            let question = Question { frame, joint: &joint };
            engine.explain(&files.inputs(&request, &[]), &question, &knowledge, limits, control)
        })
        .await
    }

    /// A config as it is understood, as a JSON object.
    ///
    /// # Errors
    /// As [`crate::engine::check_config`].
    pub async fn check_config(&self, config: ConfigDocument) -> Result<serde_json::Value, Refusal> {
        let work = move |engine: &dyn Engine, _: &Limits, _: &Control| {
            engine.check_config(NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() })
        };
        self.look("check", "reading the config", work).await
    }
}
