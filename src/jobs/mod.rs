//! Scheduling: what happens to a job between being asked for and having its results.
//!
//! A job is plain data (digests of files, a config, formats), so it can be run again after a crash. [`Jobs`] is what
//! everything else calls: submit, look, wait, cancel, retry, delete. [`Assets`] takes uploads and looks into them. [`Library`] keeps
//! what users teach the service under a name.
//! [`Workers`] runs what is queued. The queue is bounded by count and by bytes; what does not fit is refused at once.
//! A job that panics or runs over its time fails alone.
//!
//! Knows nothing of HTTP. The engine is handed in, so that tests can put one of their own in its place.

mod assets;
mod bridge;
mod failure;
mod inputs;
mod inspections;
mod library;
mod proposals;
mod queue;
mod recovery;
mod refusal;
mod running;
mod service;
mod state;
mod stopping;
#[cfg(test)]
mod tests;
mod worker;

pub use assets::{Assets, ReceivedFile, Upload};
pub use bridge::{Engine, RetargetEngine};
pub use failure::FailureReason;
pub use library::{Kept, Library, Written};
pub use refusal::Refusal;
pub use service::{JobSnapshot, Jobs, NewJob};
pub use state::{JobEvent, next_state};
pub use stopping::{Sweeper, Workers};

pub use crate::store::{
    AssetId, AssetRecord, ByteStream, ConfigDocument, DocumentKind, InputRole, JobFailure, JobId, JobInput, JobRecord,
    JobRequest, JobState, Page, Precondition, ResultId, ResultRecord, StoreError, StoredFieldError, VersionedName,
};
