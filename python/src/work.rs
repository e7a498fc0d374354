//! Work of the engine while the interpreter does something else, and hears Ctrl-C.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        LazyLock, Mutex, PoisonError,
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::{Duration, Instant},
};

use pyo3::{exceptions::PyOSError, prelude::*};
use retargetd::engine::{Control, Failure, FailureCode};

use crate::errors::raised;

/// How often to look whether somebody pressed Ctrl-C.
const LOOK: Duration = Duration::from_millis(50);
/// As much as a main thread has on most systems; decoders of nested documents count on it.
const STACK_BYTES: usize = 8 << 20;

/// Does work in a thread of its own with the interpreter's lock let go. An exception that a signal raises (Ctrl-C) cancels it and is
/// raised when it has stopped.
pub(crate) fn work<T: Send>(py: Python<'_>, work: impl FnOnce(&Control) -> Result<T, Failure> + Send) -> PyResult<T> {
    let control = Control::with_clock(seconds);
    let (sender, done) = mpsc::sync_channel(1);
    let (control, done) = (&control, Mutex::new(done));
    let result: PyResult<Result<T, Failure>> = thread::scope(|scope| {
        let job = move || {
            let result = catch_unwind(AssertUnwindSafe(|| in_pool(|| work(control))));
            // Somebody waits until the end of the scope.
            let _ = sender.send(result.unwrap_or_else(|_| Err(fault())));
        };
        let started = thread::Builder::new().name("retargetd".to_owned()).stack_size(STACK_BYTES);
        started.spawn_scoped(scope, job).map_err(|error| PyOSError::new_err(error.to_string()))?;
        py.detach(|| {
            let done = done.lock().unwrap_or_else(PoisonError::into_inner);
            loop {
                match done.recv_timeout(LOOK) {
                    Ok(result) => return Ok(result),
                    Err(RecvTimeoutError::Disconnected) => return Ok(Err(fault())),
                    Err(RecvTimeoutError::Timeout) => {
                        if let Err(interrupt) = Python::attach(|py| py.check_signals()) {
                            control.cancel();
                            // Engines look every few milliseconds.
                            let _ = done.recv();
                            return Err(interrupt);
                        }
                    }
                }
            }
        })
    });
    result?.map_err(|failure| raised(py, &failure))
}

fn fault() -> Failure {
    Failure::new(FailureCode::Internal, "a fault in the engine").with_hint("please report it with the files")
}

/// Seconds since the first call.
fn seconds() -> f64 {
    static BEGIN: LazyLock<Instant> = LazyLock::new(Instant::now);
    BEGIN.elapsed().as_secs_f64()
}

/// Runs in the usual pool of threads. A process that was forked has none of its parent's threads, so it gets a pool of its own.
fn in_pool<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static FIRST: LazyLock<u32> = LazyLock::new(std::process::id);
    static FORKED: Mutex<Option<(u32, &'static rayon::ThreadPool)>> = Mutex::new(None);
    let own = std::process::id();
    if *FIRST == own {
        return work();
    }
    let mut forked = FORKED.lock().unwrap_or_else(PoisonError::into_inner);
    if forked.is_none_or(|(process, _)| process != own) {
        // One per process: it lives as long as that.
        *forked = rayon::ThreadPoolBuilder::new().build().ok().map(|pool| (own, &*Box::leak(Box::new(pool))));
    }
    let pool = forked.map(|(_, pool)| pool);
    drop(forked);
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}
