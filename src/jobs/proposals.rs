//! What a retarget would do, without a job: for who maps rigs or edits configs, and waits for the answer.

use super::{
    Assets, Engine, EngineRequest, NewJob, Question, Refusal, engine::InputBytes, library, looks::Look, memory,
    submission::ResolvedJob,
};
use crate::{
    engine::{Control, Knowledge, Limits, NamedBytes},
    store::{ConfigDocument, JobRequest, Principal},
};

impl Assets {
    /// What a job with these inputs would do, as a JSON object, and the inputs that were found.
    ///
    /// # Errors
    /// When an input is not there, or as [`crate::engine::propose`].
    pub async fn propose(&self, owner: &Principal, new: NewJob) -> Result<(JobRequest, serde_json::Value), Refusal> {
        self.ask_about(owner, new, ("propose", "looking into the files"), Question::Propose).await
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
        let question = Question::Explain { frame, joint };
        Ok(self.ask_about(owner, new, ("explain", "explaining the joint"), question).await?.1)
    }

    /// Asks the engine about the inputs of a job. Gives the inputs that were found, too.
    async fn ask_about(
        &self,
        owner: &Principal,
        new: NewJob,
        (thread, what): (&'static str, &'static str),
        question: Question,
    ) -> Result<(JobRequest, serde_json::Value), Refusal> {
        let ResolvedJob { request, memory_bytes, .. } = self.jobs.resolve(owner, new).await?;
        let look = Look { owner, thread, what, memory_bytes };
        let load = async {
            let bytes = InputBytes::read(&self.jobs.0.store, &request).await?;
            Ok((bytes, library::knowledge(&self.jobs.0.store, owner, &request.rigs).await?, request.clone()))
        };
        let answer = self.jobs.look(look, load, move |(bytes, knowledge, request), engine, limits, control| {
            let asked = EngineRequest { question, files: bytes.files(request), formats: &[], knowledge, limits };
            engine.ask(&asked, control)?.document()
        });
        let answer = answer.await?;
        Ok((request, answer))
    }

    /// A config as it is understood, as a JSON object.
    ///
    /// # Errors
    /// As [`crate::engine::check_config`].
    pub async fn check_config(&self, owner: &Principal, config: ConfigDocument) -> Result<serde_json::Value, Refusal> {
        let memory_bytes = memory::of_job([memory::of_unknown_file(config.text.len() as u64)].into_iter(), 1.0);
        let look = Look { owner, thread: "check", what: "reading the config", memory_bytes };
        let work = |config: &ConfigDocument, engine: &dyn Engine, limits: &Limits, control: &Control| {
            let named = NamedBytes { name: &config.file_name, bytes: config.text.as_bytes() };
            engine.ask(&EngineRequest::of_config(named, &Knowledge::default(), limits), control)?.document()
        };
        self.jobs.look(look, std::future::ready(Ok(config)), work).await
    }
}
