//! What is fuzzed, from what, and how inputs are changed.
//!
//! The fuzzer of this folder and `tests/it/fuzzing.rs` of the service are built from the same files: the one searches for as long as it is
//! let, the other makes the same mutations again in every run of the test command.

mod checks;
mod container;
mod mutation;
mod seeds;
mod targets;

pub(crate) use mutation::{Random, change_bytes, mutate};
pub(crate) use seeds::seeds;
pub(crate) use targets::Target;
