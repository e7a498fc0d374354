//! The routes, one resource per file. A handler translates: request to a call, outcome to a view.

pub(super) mod assets;
pub(super) mod batches;
pub(super) mod comparisons;
pub(super) mod displays;
pub(super) mod drawing_annotations;
pub(super) mod drawings;
pub(super) mod edits;
pub(super) mod events;
pub(super) mod explanations;
pub(super) mod info;
pub(super) mod jobs;
pub(super) mod keys;
pub(super) mod library;
pub(super) mod new_batch;
pub(super) mod new_job;
pub(super) mod poses;
pub(super) mod previews;
pub(super) mod probes;
pub(super) mod proposals;
pub(super) mod results;
pub(super) mod retarget;
pub(super) mod usage;
pub(super) mod webhooks;
