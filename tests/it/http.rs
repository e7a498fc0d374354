//! The HTTP service, from outside.

mod access;
mod black_box;
mod container;
mod creatures;
mod documents;
mod edits;
mod facts;
mod formats;
mod idempotency;
mod library;
mod network;
mod ops;
mod poses;
mod proposals;
mod real;
mod reports;
mod schema_fuzz;
mod service;
mod support;
