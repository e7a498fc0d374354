//! Nothing acknowledged is ever lost: records on both databases, processes that die, stores that fail, many workers.
//!
//! Postgres and an S3 server are started here, each on a free port and in a folder of its own; `tests/run` installs both.

mod batch_records;
mod batches;
mod crashes;
mod model;
mod named_records;
mod records;
mod scale_out;
mod studio;
mod support;

pub(crate) use studio::CLIP;
