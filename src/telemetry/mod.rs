//! How the service is seen from outside: log lines, metrics, traces, and the clock that everything reads.
//!
//! Knows no job and no request.

mod clock;
mod logs;
mod metrics;
mod traces;

pub use clock::{Clock, monotonic_seconds};
pub use logs::start_logs;
pub use metrics::{Metric, MetricKind, Metrics};
pub use traces::{Part, Span, TraceContext, TracesError, start_traces, stop_traces};
