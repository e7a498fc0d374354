//! How the service is seen from outside: log lines, metrics, and the clock that everything reads.
//!
//! Knows no job and no request.

mod clock;
mod logs;
mod metrics;

pub use clock::{Clock, monotonic_seconds};
pub use logs::start_logs;
pub use metrics::{Metric, MetricKind, Metrics};
