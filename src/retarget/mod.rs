//! The algorithm: a [`Plan`] compiled once from a mapping and a clip, a loop over frames, and measures of the result.
//!
//! Per frame there are indices and constants only. Knows no format, no name and no file.

mod compile;
mod lanes;
mod measure;
mod plan;
mod run;
mod workspace;

pub use measure::{ContactMeasure, Curves, LimbDirection, Measures, Metric, SidePair, Verdict, Worst, measure};
pub use plan::Plan;
pub use run::{RunError, run};
