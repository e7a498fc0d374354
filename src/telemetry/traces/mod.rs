//! Traces: what a request went through, in every process that had to do with it, told to an OpenTelemetry collector.
//!
//! Off unless a collector is named; a span then costs one look whether it is. Spans are handed to a queue that is bounded and never
//! waits: what a collector that is slow or away does not take is dropped. Between processes a span is known by its [`TraceContext`],
//! which travels in headers and in the records of jobs.

mod context;
mod export;
mod span;

pub use context::TraceContext;
pub use export::{TracesError, start_traces, stop_traces};
pub use span::{Part, Span};
