//! Where the engine works: in this process, or in processes of its own.

use std::sync::{Arc, Mutex, PoisonError};

use retargetd::{
    engine::{Failure, FailureCode},
    jobs::{Bounds, Engine, ProcessEngine, RetargetEngine},
};

/// As the service's `process_memory`, `max_output_bytes` and `job_timeout` are when nobody says otherwise.
const BOUNDS: Bounds = Bounds { memory_bytes: 4 << 30, output_bytes: 1 << 30, seconds: 600 };
/// Processes that wait for the next call.
const MOST_IDLE: usize = 2;

/// The engine that answers a call.
///
/// # Errors
/// When its processes cannot be of any program.
pub(crate) fn engine(isolate: bool) -> Result<Arc<dyn Engine>, Failure> {
    if !isolate {
        return Ok(Arc::new(RetargetEngine));
    }
    static ISOLATED: Mutex<Option<(u32, Arc<ProcessEngine>)>> = Mutex::new(None);
    let own = std::process::id();
    let mut isolated = ISOLATED.lock().unwrap_or_else(PoisonError::into_inner);
    match &*isolated {
        Some((process, engine)) if *process == own => return Ok(Arc::clone(engine) as Arc<dyn Engine>),
        // What a parent has started is the parent's: after a fork it is neither used nor ended.
        Some((_, engine)) => std::mem::forget(Arc::clone(engine)),
        None => {}
    }
    let engine = ProcessEngine::within(BOUNDS, MOST_IDLE)
        .map_err(|error| Failure::new(FailureCode::Internal, format!("no engine process can be started: {error}")))?;
    let engine = Arc::new(engine);
    *isolated = Some((own, Arc::clone(&engine)));
    Ok(engine)
}
