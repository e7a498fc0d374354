//! What a retarget would do, without a job: for who maps rigs or edits configs, and waits for the answer.

use super::{Assets, Engine, Jobs, NewJob, Refusal, inputs::InputBytes, looks::Look, memory, submission::Wanted};
use crate::{
    engine::{Control, Knowledge, Limits, NamedBytes, Question},
    store::{ConfigDocument, JobRequest, Principal},
};

impl Assets {
    /// What a job with these inputs would do, as a JSON object, and the inputs that were found.
    ///
    /// # Errors
    /// When an input is not there, or as [`crate::engine::propose`].
    pub async fn propose(&self, owner: &Principal, new: NewJob) -> Result<(JobRequest, serde_json::Value), Refusal> {
        let Wanted { request, memory_bytes, .. } = self.jobs.resolve(owner, new).await?;
        let look = Look { owner, thread: "propose", what: "looking into the files", memory_bytes };
        let work = request.clone();
        let proposal = self.jobs.look(
            look,
            self.jobs.files_and_knowledge(owner, &request),
            move |read, engine, limits, control| engine.propose(&read.0.inputs(&work, &[]), &read.1, limits, control),
        );
        let proposal = proposal.await?;
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
        let Wanted { request, memory_bytes, .. } = self.jobs.resolve(owner, new).await?;
        let look = Look { owner, thread: "explain", what: "explaining the joint", memory_bytes };
        let work = request.clone();
        let explanation = self.jobs.look(
            look,
            self.jobs.files_and_knowledge(owner, &request),
            move |read, engine, limits, control| {
                let question = Question { frame, joint: &joint };
                engine.explain(&read.0.inputs(&work, &[]), &question, &read.1, limits, control)
            },
        );
        explanation.await
    }

    /// A config as it is understood, as a JSON object.
    ///
    /// # Errors
    /// As [`crate::engine::check_config`].
    pub async fn check_config(&self, owner: &Principal, config: ConfigDocument) -> Result<serde_json::Value, Refusal> {
        let memory_bytes = memory::of_job([memory::of_unknown_file(config.text.len() as u64)].into_iter(), 1.0);
        let look = Look { owner, thread: "check", what: "reading the config", memory_bytes };
        let work = |config: &ConfigDocument, engine: &dyn Engine, _: &Limits, control: &Control| {
            engine.check_config(NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() }, control)
        };
        self.jobs.look(look, std::future::ready(Ok(config)), work).await
    }
}

impl Jobs {
    /// What a look at the files of a request needs.
    async fn files_and_knowledge(
        &self,
        owner: &Principal,
        request: &JobRequest,
    ) -> Result<(InputBytes, Knowledge), Refusal> {
        Ok((self.read_inputs(request).await?, self.knowledge(owner, &request.rigs).await?))
    }
}
