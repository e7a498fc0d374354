//! The engine as the service sees it.

use crate::engine::{self, Control, Failure, Inputs, Knowledge, Limits, NamedBytes, Outcome, Question};

/// What does the work. Handed in, so that tests of the scheduling need no real files.
pub trait Engine: Send + Sync + 'static {
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
    ) -> Result<Outcome, Failure>;

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
    fn check_config(&self, config: NamedBytes<'_>) -> Result<serde_json::Value, Failure>;
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
    ) -> Result<Outcome, Failure> {
        engine::retarget_with(inputs, knowledge, limits, control)
    }

    fn inspect(
        &self,
        file: NamedBytes<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::inspect_with(file, knowledge, limits, control)?)
    }

    fn propose(
        &self,
        inputs: &Inputs<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::propose_with(inputs, knowledge, limits, control)?)
    }

    fn explain(
        &self,
        inputs: &Inputs<'_>,
        question: &Question<'_>,
        knowledge: &Knowledge,
        limits: &Limits,
        control: &Control,
    ) -> Result<serde_json::Value, Failure> {
        to_json(engine::explain_with(inputs, question, knowledge, limits, control)?)
    }

    fn check_config(&self, config: NamedBytes<'_>) -> Result<serde_json::Value, Failure> {
        engine::check_config(config)
    }
}

fn to_json(answer: impl serde::Serialize) -> Result<serde_json::Value, Failure> {
    serde_json::to_value(answer)
        .map_err(|error| Failure::new(engine::FailureCode::Internal, format!("the answer is no JSON: {error}")))
}

/// Runs `work` on a thread of its own, with a stack of a size that does not depend on who asks. `None` when it panicked.
///
/// The thread goes on when the receiver is dropped; `work` ends early only when its control is canceled.
pub(super) fn on_own_thread<T: Send + 'static>(
    name: &str,
    work: impl FnOnce() -> T + Send + 'static,
) -> tokio::sync::oneshot::Receiver<Option<T>> {
    const STACK_BYTES: usize = 8 << 20;
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
