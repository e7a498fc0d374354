//! The engine in processes of its own, so that a file that brings a decoder down ends one job and nothing else.
//!
//! A child is the same program, started as `retargetd engine-process`. It reads requests from its standard input and answers on its
//! standard output, one at a time, and serves many one after the other. It bounds its memory, its processor time and its core files
//! itself, before it reads anything, and gives up files, sockets and other programs as far as the kernel lets it ([`sandbox`]); it has no
//! environment and no database: bytes come in, bytes go out. It ends when its input
//! does, and by no signal that is meant for its parent, so it never outlives its parent, however that ends. A child that dies, or does not stop when it is told to, is replaced.

mod child;
mod frames;
mod idle;
mod kept_target;
mod limits;
mod memory_watch;
mod messages;
mod priority;
mod process;
mod program;
mod sandbox;
mod signals;
#[cfg(test)]
mod tests;
mod threads;

pub use child::serve as serve_engine_process;
pub use limits::{Bounds, keep_memory_private, use_small_pages};
pub use priority::give_way_by;
pub use program::{Program, engine_processes_are};

use std::io;

use self::{
    frames::Digested,
    idle::Idle,
    memory_watch::MemoryWatch,
    messages::Reply,
    process::{EngineProcess, Lost},
    threads::AtWork,
};
use super::{Answer, Engine, EngineRequest, EngineResult, OutputFile, failure};
use crate::{
    config::{MemoryBudget, Settings},
    engine::{Control, Failure, FailureCode, Format, Output},
    telemetry::Metric,
};

/// An engine that works in other processes.
#[derive(Debug)]
pub struct ProcessEngine {
    program: Program,
    bounds: Bounds,
    most_requests: u64,
    /// Those that wait for a request.
    idle: Idle<EngineProcess>,
    at_work: AtWork,
    memory_watch: MemoryWatch,
}

impl ProcessEngine {
    /// One whose processes are of this program, within the bounds of the settings. None is started before it is needed.
    ///
    /// # Errors
    /// When it cannot be found out where this program is.
    pub fn new(settings: &Settings) -> io::Result<Self> {
        let bounds = Bounds {
            memory_bytes: settings.process_memory.0,
            output_bytes: settings.max_output_bytes.0,
            seconds: settings.job_timeout.0.as_secs().max(1),
        };
        // All jobs that run at the same time find one, and looks wait for a start now and then.
        let most_idle = settings.workers.0 + 1;
        Ok(Self { most_requests: settings.max_process_requests, ..Self::within(bounds, most_idle)? })
    }

    /// One whose processes are within these bounds; so many wait for a request.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn within(bounds: Bounds, most_idle: usize) -> io::Result<Self> {
        /// Memory that a process has taken once is its own again after so many.
        const MAX_REQUESTS: u64 = 200;
        Ok(Self {
            program: Program::own()?,
            bounds,
            most_requests: MAX_REQUESTS,
            idle: Idle::new(most_idle),
            at_work: AtWork::default(),
            memory_watch: MemoryWatch::new(bounds.memory_bytes, MemoryBudget::of_all_processes()),
        })
    }

    /// One that waits, before all others one that keeps this target; a new one where none waits.
    fn take(&self, target_sha256: Option<&str>) -> Result<EngineProcess, Failure> {
        let keeps_it = |process: &EngineProcess| target_sha256.is_some_and(|sha256| process.keeps_target(sha256));
        loop {
            let Some(mut process) = self.idle.take(keeps_it) else {
                return EngineProcess::start(&self.program, &self.bounds, &self.memory_watch).map_err(not_started);
            };
            if process.is_alive() {
                return Ok(process);
            }
        }
    }

    fn send(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<(Reply, Vec<Digested>), Failure> {
        let mut process = self.take(asked.files.target_sha256)?;
        let (_at_work, threads) = self.at_work.begin();
        match process.ask(asked, threads, control) {
            Ok(answer) => {
                if process.requests() < self.most_requests && process.is_as_new() {
                    self.idle.put(process);
                }
                Ok(answer)
            }
            Err(Lost::Canceled) => Err(Failure::new(FailureCode::Canceled, "canceled")),
            Err(Lost::Crashed(reason)) => {
                Metric::EngineProcessesLost.count([], 1);
                tracing::error!(reason, "an engine process died");
                Err(Failure::new(FailureCode::EngineCrashed, format!("the process that worked on it died: {reason}"))
                    .with_hint("check the files with 'retargetd inspect'; if they look well, report it"))
            }
        }
    }
}

fn not_started(error: io::Error) -> Failure {
    tracing::error!(%error, "an engine process could not be started");
    unexpected("it could not be started")
}

fn unexpected(what: &str) -> Failure {
    Failure::new(FailureCode::Internal, format!("the engine process gave no answer that can be used: {what}"))
}

/// An answer that is not the one that was asked for.
fn otherwise(reply: Reply) -> Failure {
    match reply {
        Reply::Failed(kept) => failure::restore(kept),
        Reply::Panicked => unexpected("a fault in the engine"),
        _ => unexpected("it answers something else"),
    }
}

impl Engine for ProcessEngine {
    fn is_isolated(&self) -> bool {
        true
    }

    fn ask(&self, asked: &EngineRequest<'_>, control: &Control) -> Result<Answer, Failure> {
        let (reply, blobs) = self.send(asked, control)?;
        let mut blobs = blobs.into_iter();
        let mut first = || blobs.next().map_or_else(Vec::new, |blob| blob.bytes);
        let (timings, warnings, judgment, names) = match reply {
            Reply::EngineResult { timings, warnings, judgment, outputs } => (timings, warnings, judgment, outputs),
            Reply::Document => {
                let document = serde_json::from_slice(&first());
                return document.map(Answer::Document).map_err(|error| unexpected(&format!("no JSON: {error}")));
            }
            Reply::Picture => return Ok(Answer::Picture(first())),
            Reply::Archive => return Ok(Answer::Archive(first())),
            other => return Err(otherwise(other)),
        };
        let mut text = || String::from_utf8(blobs.next()?.bytes).ok();
        let (report, resolved_spec) = text().zip(text()).ok_or_else(|| unexpected("no report"))?;
        let outputs = names.into_iter().zip(blobs).map(|((format, name), Digested { bytes, sha256 })| {
            let format = Format::from_name(&format).ok_or_else(|| unexpected("an output of no known format"))?;
            Ok(OutputFile { output: Output { format, name, bytes }, sha256: Some(sha256) })
        });
        let outputs = outputs.collect::<Result<_, Failure>>()?;
        Ok(Answer::EngineResult(Box::new(EngineResult { outputs, report, resolved_spec, timings, warnings, judgment })))
    }

    fn tidy(&self) {
        self.idle.tidy();
    }
}
