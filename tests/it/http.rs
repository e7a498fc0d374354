//! The HTTP service, from outside.

mod access;
mod asking;
mod batches;
mod black_box;
mod container;
mod creatures;
mod documents;
mod edits;
mod events;
mod facts;
mod formats;
mod idempotency;
mod isolation;
mod library;
mod network;
mod ops;
mod poses;
mod proposals;
mod real;
mod reports;
mod result_cache;
mod schema_fuzz;
mod service;
mod support;
