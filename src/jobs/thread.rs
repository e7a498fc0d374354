//! Where the engine runs: on a thread of its own, or in the place of who asks.

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
