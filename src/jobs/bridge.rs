//! The engine as the service sees it.

use crate::{
    engine::{self, Control, Failure, Inputs, Knowledge, Limits, NamedBytes, Outcome, Output, Question, Timings},
    store::{JobVerdict, Judgment},
};

/// A file that came out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MadeFile {
    /// The file.
    pub output: Output,
    /// The SHA-256 of its bytes in hexadecimal, where it was found on the way.
    pub sha256: Option<String>,
}

/// What a retarget gave, as plain data that can come from anywhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Ran {
    /// The files.
    pub outputs: Vec<MadeFile>,
    /// What was measured, as JSON.
    pub report: String,
    /// The spec with everything found out filled in, as JSON.
    pub resolved_spec: String,
    /// How long each phase took.
    pub timings: Timings,
    /// How many warnings the report has.
    pub warnings: u64,
    /// What the report says of the result as a whole.
    pub judgment: Option<Judgment>,
}

impl TryFrom<Outcome> for Ran {
    type Error = Failure;

    fn try_from(outcome: Outcome) -> Result<Self, Failure> {
        let Outcome { outputs, report, resolved_spec } = outcome;
        Ok(Self {
            outputs: outputs.into_iter().map(|output| MadeFile { output, sha256: None }).collect(),
            resolved_spec: resolved_spec.to_string(),
            timings: report.timings,
            warnings: report.warnings.len() as u64,
            judgment: report.measures.as_ref().map(|measures| Judgment {
                verdict: JobVerdict::from_name(measures.verdict.name()).unwrap_or(JobVerdict::NotApplicable),
                reason: measures.verdict_reason.clone(),
                coverage: measures.coverage,
            }),
            report: serde_json::to_string(&report).map_err(|error| no_json(&error))?,
        })
    }
}

/// What does the work. Handed in, so that tests of the scheduling need no real files.
pub trait Engine: Send + Sync + 'static {
    /// Whether a file that brings the engine down does no harm to this process.
    fn is_isolated(&self) -> bool {
        false
    }

    /// Retargets, with what users taught beside what the program knows. Must look at `control` every few milliseconds.
    ///
    /// # Errors
    /// As [`engine::retarget`].
    fn retarget(
        &self,
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<Ran, Failure>;

    /// Says what a file holds, as a JSON object.
    ///
    /// # Errors
    /// As [`engine::inspect`].
    fn inspect(
        &self,
        file: NamedBytes<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure>;

    /// Says what a retarget would do, as a JSON object.
    ///
    /// # Errors
    /// As [`engine::propose`].
    fn propose(
        &self,
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure>;

    /// Says why a joint of a result is turned as it is at a frame, as a JSON object.
    ///
    /// # Errors
    /// As [`engine::explain_with`].
    fn explain(
        &self,
        inputs: &Inputs<'_>,
        question: &Question<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure>;

    /// Reads a config by itself and gives it back as it is understood.
    ///
    /// # Errors
    /// As [`engine::check_config`].
    fn check_config(&self, config: NamedBytes<'_>, control: &Control) -> Result<serde_json::Value, Failure>;

    /// Lets go of what has not been used for a while; to be called from time to time.
    fn tidy(&self) {}
}

/// The real one.
#[derive(Clone, Copy, Debug, Default)]
pub struct RetargetEngine;

impl Engine for RetargetEngine {
    fn retarget(
        &self,
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<Ran, Failure> {
        engine::retarget_with(inputs, knowledge.parsed()?.as_ref(), limits, control)?.try_into()
    }

    fn inspect(
        &self,
        file: NamedBytes<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::inspect_with(file, knowledge.parsed()?.as_ref(), limits, control)?)
    }

    fn propose(
        &self,
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::propose_with(inputs, knowledge.parsed()?.as_ref(), limits, control)?)
    }

    fn explain(
        &self,
        inputs: &Inputs<'_>,
        question: &Question<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::explain_with(inputs, question, knowledge.parsed()?.as_ref(), limits, control)?)
    }

    fn check_config(&self, config: NamedBytes<'_>, _: &Control) -> Result<serde_json::Value, Failure> {
        engine::check_config(config)
    }
}

fn to_json(answer: impl serde::Serialize) -> Result<serde_json::Value, Failure> {
    serde_json::to_value(answer).map_err(|error| no_json(&error))
}

fn no_json(error: &serde_json::Error) -> Failure {
    Failure::new(engine::FailureCode::Internal, format!("the answer is no JSON: {error}"))
}

/// What the engine may put on the stack.
pub(super) const STACK_BYTES: usize = 8 << 20;

/// Runs `work` before this returns; other tasks of this thread go on elsewhere. `None` when it panicked.
pub(super) fn in_place<T>(work: impl FnOnce() -> T) -> tokio::sync::oneshot::Receiver<Option<T>> {
    let (sender, receiver) = tokio::sync::oneshot::channel();
    let run = || std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).ok();
    // The receiver is here.
    let _ = sender.send(tokio::task::block_in_place(run));
    receiver
}

/// Runs `work` on a thread of its own, with a stack of a size that does not depend on who asks. `None` when it panicked.
///
/// The thread goes on when the receiver is dropped; `work` ends early only when its control is canceled.
pub(super) fn on_own_thread<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> tokio::sync::oneshot::Receiver<Option<T>> {
    let (sender, receiver) = tokio::sync::oneshot::channel();
    let run = move || {
        let outcome = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).ok();
        // Nobody is left to tell when the job was given up.
        let _ = sender.send(outcome);
    };
    // When no thread can be made the sender is dropped, which the receiver sees.
    if let Err(error) = std::thread::Builder::new().name(name.to_owned()).stack_size(STACK_BYTES).spawn(run) {
        tracing::error!(%error, "no thread could be started");
    }
    receiver
}
