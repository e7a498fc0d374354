//! The import law of the crate docs, and the other rules that a machine can check.
