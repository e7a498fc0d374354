//! Signals that are meant for the service.

use std::io;

/// From now on, what asks a process to end is left to the parent. Terminals and service managers send it to every process of a group; it
/// is the service that decides how long running jobs may go on, and its engine processes end with it.
///
/// # Errors
/// When the system refuses.
#[cfg(unix)]
pub(super) fn leave_to_parent() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let _entered = runtime.enter();
    for kind in [SignalKind::terminate(), SignalKind::interrupt(), SignalKind::hangup()] {
        // What a signal does by itself is replaced for as long as the process lives, whether anybody listens or not.
        drop(signal(kind)?);
    }
    Ok(())
}

#[cfg(not(unix))]
pub(super) fn leave_to_parent() -> io::Result<()> {
    Ok(())
}
