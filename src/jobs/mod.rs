//! Scheduling: what happens to a job between being asked for and having its results.
//!
//! A job is plain data (digests of files, a config, formats), so it can be run again after a crash. [`Jobs`] is what
//! everything else calls: submit, look, wait, cancel, retry, delete. [`Assets`] takes uploads and looks into them. [`Library`] keeps
//! what users teach the service under a name, [`Webhooks`] keep whom to tell of the ends of jobs. All of them ask who owns what is asked for; [`Keys`] says who asks.
//! [`Workers`] runs what is queued. The queue lies in the store, so that any number of processes can share it; it is bounded by count
//! and by bytes, and what does not fit is refused at once. A job that panics or runs over its time fails alone; one whose
//! process dies is taken up by another when its lease has run out. The engine works in [processes](ProcessEngine) of its own, unless the
//! operator says otherwise, so that what it does to itself ends one job.
//!
//! Knows nothing of HTTP. The engine is handed in, so that tests can put one of their own in its place.

mod admission;
mod annotations;
mod assets;
mod batches;
mod built_in_assets;
mod changes;
mod curves;
mod database_clock;
mod engine;
mod events;
mod failure;
mod fetching;
mod inspections;
mod isolation;
mod kept_pictures;
mod keys;
mod library;
mod looks;
mod lost_workers;
mod memory;
mod one_shot;
mod picture_room;
mod previews;
mod proposals;
mod record_room;
mod refusal;
mod result_cache;
mod result_names;
mod running;
mod service;
mod state;
mod stored_bytes;
mod stream_tokens;
mod streams;
mod submission;
mod sweeper;
#[cfg(test)]
mod tests;
mod thread;
mod usage;
mod webhooks;
mod worker;
mod workers;

pub use annotations::NewAnnotation;
pub use assets::{Assets, ReceivedFile, Upload};
pub use batches::{ArchiveContents, BadItem, BatchSnapshot, NewBatch, SubmittedBatch};
pub use built_in_assets::BuiltInAsset;
pub use engine::{Answer, Engine, EngineRequest, EngineResult, Files, OutputFile, Question, RetargetEngine};
pub use events::{EventStream, Followed, Told};
pub use failure::FailureReason;
pub use fetching::NewFetch;
pub use isolation::{
    Bounds, ProcessEngine, Program, engine_processes_are, give_way_by, keep_memory_private, serve_engine_process,
    use_small_pages,
};
pub use keys::{KeyText, Keys, NewKey};
pub use library::{Kept, Library, Written};
pub use one_shot::{ArrivedFiles, Awaited, Awaiting, HandedFile};
pub use picture_room::ArrivingPicture;
pub use previews::Pictured;
pub use refusal::{Full, JobQuota, Refusal};
pub use service::{JobSnapshot, Jobs, engine_limits};
pub use state::{JobEvent, next_state};
pub use stream_tokens::StreamToken;
pub use submission::{NewJob, Submitted};
pub use sweeper::Sweeper;
pub use usage::Usage;
pub use webhooks::{NewWebhook, WebhookDispatcher, Webhooks};
pub use workers::Workers;

pub(crate) use crate::store::hexadecimal;
pub use crate::store::{
    ApiKeyId, ApiKeyRecord, AssetId, AssetRecord, BatchId, BatchPlace, BatchRecord, ByteStream, ConfigDocument,
    DeliveryEvent, DeliveryId, DeliveryRecord, DeliveryState, DisabledReason, DocumentKind, EventRecord, Holdings,
    InputRole, JobFailure, JobFilter, JobId, JobInput, JobKind, JobRecord, JobRequest, JobState, JobTask, JobVerdict,
    Judgment, OnError, Page, Precondition, Principal, ResultId, ResultRecord, Scope, StoreError, StoredFieldError,
    StoredProgress, VersionedName, WebhookId, WebhookRecord,
};
