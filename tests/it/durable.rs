//! Nothing acknowledged is ever lost: records on both databases, processes that die, stores that fail, many workers.
//!
//! Postgres and an S3 server are started here, each on a free port and in a folder of its own; `tests/run` installs both.

mod collector;
mod crashes;
mod model;
mod records;
mod scale_out;
mod studio;
mod support;
mod traces;

pub(crate) use studio::CLIP;
